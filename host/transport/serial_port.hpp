#pragma once
// A serial port through termios: raw, eight bits, no flow control, for this process alone (TIOCEXCL against
// other programs' open, flock against our own as root, whom TIOCEXCL does not stop).

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <string>
#include <vector>

#include "host/transport/byte_line.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

class SerialPort final : public ByteLine {
 public:
  /// Throws HardwareError when the port is absent, forbidden, busy, no terminal, or has no such rate.
  SerialPort(const std::string& path, unsigned baud) {
    const auto* rate =
        std::find_if(rates.begin(), rates.end(), [&](const Rate& each) { return each.baud == baud; });
    if (rate == rates.end()) {
      throw HardwareError(path, fmt::format("{} is not a baud rate that serial ports know", baud),
                          "Use 115200, 460800 or 921600 in the rig file, as the firmware does.");
    }
    port_ = Descriptor(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!port_.valid()) fail_open(path, errno);
    if (flock(port_.get(), LOCK_EX | LOCK_NB) != 0) fail_open(path, errno);
    make_raw(port_.get(), path, rate->speed);
    ioctl(port_.get(), TIOCEXCL);
  }

  void write(std::span<const uint8_t> bytes) override {
    if (lost_) return;
    to_send_.insert(to_send_.end(), bytes.begin(), bytes.end());
    if (to_send_.size() > most_kept_bytes) lost_ = true;
    send_kept();
  }
  size_t read(std::span<uint8_t> out) override {
    receive();
    const size_t count = std::min(out.size(), arrived_.size());
    const auto end = arrived_.begin() + static_cast<std::ptrdiff_t>(count);
    std::copy(arrived_.begin(), end, out.begin());
    arrived_.erase(arrived_.begin(), end);
    return count;
  }
  void flush(int most_ms) override {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(most_ms);
    send_kept();
    while (!to_send_.empty() && !lost_ && wait_for(POLLOUT, left_ms(end)))
      send_kept();
  }
  void wait_received(uint64_t total, int most_ms) override {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(most_ms);
    receive();
    while (received_total_ < total && !lost_ && wait_for(POLLIN, left_ms(end)))
      receive();
  }
  [[nodiscard]] bool lost() const override { return lost_; }
  [[nodiscard]] uint64_t written_total() const override { return written_total_; }
  [[nodiscard]] uint64_t received_total() const override { return received_total_; }
  [[nodiscard]] int descriptor() const override { return port_.get(); }

 private:
  struct Rate {
    unsigned baud;
    speed_t speed;
  };
  static constexpr std::array<Rate, 8> rates{{{9600, B9600},
                                              {57600, B57600},
                                              {115200, B115200},
                                              {230400, B230400},
                                              {460800, B460800},
                                              {921600, B921600},
                                              {1000000, B1000000},
                                              {2000000, B2000000}}};

  static constexpr size_t most_kept_bytes = 1U << 20;  // beyond this the other end is not listening

  [[noreturn]] void fail_open(const std::string& path, int error) {
    switch (error) {
      case ENOENT:
      case ENXIO:
      case ENODEV:
        throw HardwareError(path, "there is no such serial port",
                            "Plug the controller in and check `port` in the rig file (ls /dev/ttyACM* "
                            "/dev/ttyUSB*).");
      case EACCES:
      case EPERM:
        throw HardwareError(path, "the serial port may not be opened",
                            "Join the group that owns it (usually dialout) and log in again.");
      case EBUSY:
      case EWOULDBLOCK:
        throw HardwareError(path, "the serial port is in use by another program",
                            "Stop the other one (a running daemon, a terminal program): fuser " + path);
      default:
        throw HardwareError(path, fmt::format("cannot be opened: {}", std::strerror(error)),
                            "Check the port and its cable.");
    }
  }

  static void make_raw(int port, const std::string& path, speed_t speed) {
    termios settings{};
    if (tcgetattr(port, &settings) != 0) {
      throw HardwareError(path, "is not a serial port",
                          "Name the controller's line: `port` in the rig file, or --port.");
    }
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
    settings.c_cc[VMIN] = 0;
    settings.c_cc[VTIME] = 0;
    if (cfsetspeed(&settings, speed) != 0 || tcsetattr(port, TCSANOW, &settings) != 0) {
      throw HardwareError(path, "does not take the serial settings", "Check `baud` in the rig file.");
    }
    tcflush(port, TCIOFLUSH);
  }

  static int left_ms(std::chrono::steady_clock::time_point end) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    return static_cast<int>(std::max<int64_t>(0, left.count()));
  }

  void send_kept() {
    while (!to_send_.empty() && !lost_) {
      const ssize_t sent = ::write(port_.get(), to_send_.data(), to_send_.size());
      if (sent < 0) {
        if (errno == EINTR) continue;
        lost_ = errno != EAGAIN;
        return;
      }
      written_total_ += static_cast<uint64_t>(sent);
      to_send_.erase(to_send_.begin(), to_send_.begin() + sent);
    }
  }
  void receive() {
    std::array<uint8_t, 4096> block{};
    while (!lost_) {
      const ssize_t got = ::read(port_.get(), block.data(), block.size());
      if (got < 0) {
        if (errno == EINTR) continue;
        lost_ = errno != EAGAIN;
        return;
      }
      if (got == 0) {  // nothing there (VMIN 0), or the other end hung up
        pollfd state{port_.get(), POLLIN, 0};
        lost_ = ::poll(&state, 1, 0) > 0 && (state.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
        return;
      }
      received_total_ += static_cast<uint64_t>(got);
      arrived_.insert(arrived_.end(), block.begin(), block.begin() + got);
    }
  }
  bool wait_for(short events, int most_ms) const {
    pollfd state{port_.get(), events, 0};
    return most_ms > 0 && ::poll(&state, 1, most_ms) > 0;
  }

  Descriptor port_;
  std::vector<uint8_t> to_send_;
  std::vector<uint8_t> arrived_;
  uint64_t written_total_ = 0;
  uint64_t received_total_ = 0;
  bool lost_ = false;
};

}  // namespace diastole
