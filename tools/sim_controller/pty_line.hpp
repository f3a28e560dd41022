#pragma once
// The controller's end of the serial line: the master side of a pseudo-terminal that the daemon opens like a port.
// Nothing here waits.

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_controller {

class PtyLine {
 public:
  /// Opens the pseudo-terminal and, if `link` is not empty, a symbolic link to it (an old link is replaced;
  /// anything else there is an InputError). Throws HardwareError if the system has no pseudo-terminal left.
  explicit PtyLine(std::filesystem::path link) : link_(std::move(link)) { plug_in(); }
  ~PtyLine() { hang_up(); }
  PtyLine(const PtyLine&) = delete;
  PtyLine& operator=(const PtyLine&) = delete;

  /// The path to open: the link if there is one.
  [[nodiscard]] std::string path() const { return link_.empty() ? device_ : link_.string(); }
  /// Readable when bytes have come; -1 while nobody has the port open (it would be readable all the time).
  [[nodiscard]] int descriptor() const { return open_ ? master_ : -1; }

  /// Looks whether the port was opened or closed meanwhile; at an opening both counts start anew.
  void refresh() {
    if (master_ < 0) return;
    pollfd state{master_, 0, 0};
    ::poll(&state, 1, 0);
    const bool open = (state.revents & POLLHUP) == 0;
    if (open && !open_) restart_counts();
    open_ = open;
  }
  void restart_counts() {
    queued_.clear();
    received_total_ = 0;
    sent_total_ = 0;
  }

  std::vector<uint8_t> read() {
    std::vector<uint8_t> bytes;
    std::array<uint8_t, 4096> block{};
    while (open_) {
      const ssize_t got = ::read(master_, block.data(), block.size());
      if (got <= 0) break;
      bytes.insert(bytes.end(), block.begin(), block.begin() + got);
    }
    received_total_ += bytes.size();
    return bytes;
  }
  /// Queues bytes and sends what the line takes; bytes sent to nobody are lost, as on a wire.
  void write(std::span<const uint8_t> bytes) {
    if (!open_) return;
    queued_.insert(queued_.end(), bytes.begin(), bytes.end());
    sent_total_ += bytes.size();
    send_queued();
  }
  void send_queued() {
    std::array<uint8_t, 1024> block{};
    while (open_ && !queued_.empty()) {
      const size_t count = std::min(block.size(), queued_.size());
      std::copy_n(queued_.begin(), count, block.begin());
      const ssize_t sent = ::write(master_, block.data(), count);
      if (sent <= 0) return;
      queued_.erase(queued_.begin(), queued_.begin() + sent);
    }
  }

  /// Pulls the plug: whoever has the port open sees a hang-up; nobody can open it until it is plugged in again,
  /// as another device behind the same link.
  void hang_up() {
    if (master_ < 0) return;
    ::close(master_);
    master_ = -1;
    open_ = false;
    std::error_code ignored;
    if (!link_.empty()) std::filesystem::remove(link_, ignored);
  }
  /// No effect unless it is unplugged. Throws as the constructor does.
  void plug_in() {
    if (master_ >= 0) return;
    master_ = open_master();
    device_ = device_of(master_);
    make_raw(device_);
    try {
      if (!link_.empty()) make_link(link_, device_);
    } catch (...) {
      ::close(master_);
      master_ = -1;
      throw;
    }
  }
  [[nodiscard]] bool plugged_in() const { return master_ >= 0; }

  /// Bytes since the port was opened.
  [[nodiscard]] uint64_t received_total() const { return received_total_; }
  [[nodiscard]] uint64_t sent_total() const { return sent_total_; }

 private:
  static int open_master() {
    const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0) {
      throw HardwareError("/dev/ptmx", fmt::format("no pseudo-terminal: {}", std::strerror(errno)),
                          "Mount devpts, or raise /proc/sys/kernel/pty/max.");
    }
    return master;
  }

  static std::string device_of(int master) {
    std::array<char, 128> name{};
    ::ptsname_r(master, name.data(), name.size());
    return name.data();
  }

  /// Opens and closes the device once: sets it raw, and makes the master report "nobody there" from the start.
  static void make_raw(const std::string& device) {
    const int slave = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios settings{};
    ::tcgetattr(slave, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(slave, TCSANOW, &settings);
    ::close(slave);
  }

  static void make_link(const std::filesystem::path& link, const std::string& device) {
    std::error_code error;
    if (std::filesystem::is_symlink(link)) {
      std::filesystem::remove(link, error);
    } else if (std::filesystem::exists(link)) {
      throw InputError(
          {link.string(), "", "exists and is no symbolic link", "Choose another path for --link."});
    }
    std::filesystem::create_symlink(device, link, error);
    if (error) {
      throw InputError({link.string(), "", fmt::format("the link cannot be made: {}", error.message()),
                        "Choose a directory in which you may write for --link."});
    }
  }

  std::filesystem::path link_;
  int master_ = -1;
  std::string device_;
  bool open_ = false;
  std::deque<uint8_t> queued_;
  uint64_t received_total_ = 0;
  uint64_t sent_total_ = 0;
};

}  // namespace diastole::sim_controller
