#pragma once
// Time as a simulated rig conducts it: see protocol/contract/conductor.hpp for the exchange.

#include <algorithm>
#include <cerrno>
#include <string>

#include "host/transport/clock.hpp"
#include "host/transport/descriptor.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/conductor.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

class ConductedClock final : public Clock {
 public:
  /// Connects to the rig's socket. Throws HardwareError if nobody listens there.
  explicit ConductedClock(const std::string& path) : path_(path), socket_(connect_unix_socket(path)) {
    now_ns_ = ask({}).now_ns;
  }

  /// Moves outside of sleeps only when the rig says so unasked.
  [[nodiscard]] uint64_t now_ns() override {
    conductor::Record record{};
    while (::recv(socket_.get(), record.data(), record.size(), MSG_DONTWAIT | MSG_PEEK) ==
           static_cast<ssize_t>(record.size())) {
      (void)::recv(socket_.get(), record.data(), record.size(), 0);
      take(conductor::decode_advanced(record));
    }
    return now_ns_;
  }
  /// Throws HardwareError if the rig has gone: without it time cannot go on.
  void sleep_until_ns(uint64_t until_ns, ByteLine* line) override {
    if (line != nullptr) line->flush(longest_wait_ms);
    const auto answer = ask({until_ns, line == nullptr ? 0 : line->written_total()});
    take(answer);
    if (line != nullptr && answer.serial_bytes_sent_total > sent_before_opening_) {
      line->wait_received(answer.serial_bytes_sent_total - sent_before_opening_, longest_wait_ms);
    }
  }
  void line_opened(ByteLine& line) override {
    sent_before_opening_ = ask({0, line.written_total()}).serial_bytes_sent_total;
  }
  [[nodiscard]] bool stands_still() const override { return true; }

 private:
  static constexpr int longest_wait_ms = 1000;

  /// Moves all bytes of a record through `transfer` (read or write); false if the other end is gone.
  template <typename Transfer>
  static bool transfer_all(std::byte* bytes, size_t size, Transfer transfer) {
    for (size_t done = 0; done < size;) {
      const ssize_t moved = transfer(bytes + done, size - done);
      if (moved < 0 && errno == EINTR) continue;
      if (moved <= 0) return false;
      done += static_cast<size_t>(moved);
    }
    return true;
  }

  void take(const conductor::Advanced& advanced) { now_ns_ = std::max(now_ns_, advanced.now_ns); }
  conductor::Advanced ask(const conductor::Advance& question) {
    conductor::Record record = conductor::encode(question);
    const int fd = socket_.get();
    bool transferred = transfer_all(record.data(), record.size(), [&](std::byte* at, size_t size) {
      return ::send(fd, at, size, MSG_NOSIGNAL);
    });
    while (transferred) {
      transferred = transfer_all(record.data(), record.size(),
                                 [&](std::byte* at, size_t size) { return ::read(fd, at, size); });
      const conductor::Advanced answer = conductor::decode_advanced(record);
      if (transferred && answer.serial_bytes_sent_total != conductor::unsolicited) return answer;
      if (transferred) take(answer);
    }
    throw HardwareError(path_, "the simulated rig that conducts time has gone",
                        "Start the simulation again.");
  }

  std::string path_;
  Descriptor socket_;
  uint64_t now_ns_ = 0;
  uint64_t sent_before_opening_ = 0;  // the rig's count when the line was opened, if it did not start anew
};

}  // namespace diastole
