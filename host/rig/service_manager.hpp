#pragma once
// What the daemon reports to the program that supervises it (systemd; sd_notify(3)): that it is ready, that it is
// alive, that it stops. Without a supervisor (no NOTIFY_SOCKET) nothing is reported, and nothing else changes.
//
// The watchdog is fed by the acquisition loop, not by an idle thread: beat() is called wherever the loop goes
// to sleep, and passes the word on only while the server's thread has also been heard of within the interval.
// If either hangs, the supervisor ends the daemon; the pump then stops by its lease, and the daemon that is
// started anew moves nothing.

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <string>
#include <string_view>

#include "host/transport/descriptor.hpp"

namespace diastole {

class ServiceManager {
 public:
  ServiceManager() : interval_(watchdog_interval()), server_seen_us_(now_us()) {}

  void ready() { notify("READY=1\nSTATUS=serving"); }
  void stopping() { notify("STOPPING=1\nSTATUS=stopping"); }
  /// One line for `systemctl status`.
  void status(const std::string& text) { notify("STATUS=" + text); }

  /// Of the server's thread, at least every server_interval().
  void server_lives() { server_seen_us_ = now_us(); }
  /// Of the acquisition loop, as often as it likes.
  void beat() {
    if (interval_.count() == 0) return;
    const int64_t now = now_us();
    if (now < next_beat_us_ || now - server_seen_us_ > interval_.count()) return;
    next_beat_us_ = now + interval_.count() / beats_an_interval;
    notify("WATCHDOG=1");
  }
  /// Work that does not sleep follows, and may take `timeout` (writing a long run's file).
  void allow(std::chrono::microseconds timeout) {
    if (interval_.count() > 0) notify(fmt::format("WATCHDOG_USEC={}", std::max(timeout, interval_).count()));
  }
  /// Back to the usual interval.
  void allow_no_more() {
    if (interval_.count() > 0) notify(fmt::format("WATCHDOG_USEC={}\nWATCHDOG=1", interval_.count()));
  }

  [[nodiscard]] std::chrono::milliseconds server_interval() const {
    const auto quarter = std::chrono::duration_cast<std::chrono::milliseconds>(interval_ / beats_an_interval);
    return interval_.count() > 0 ? std::min(usual_server_interval, quarter) : usual_server_interval;
  }

 private:
  static constexpr int64_t beats_an_interval = 4;
  static constexpr std::chrono::milliseconds usual_server_interval{1000};

  /// One datagram to NOTIFY_SOCKET, without waiting: libsystemd's sd_notify waits while the supervisor does not read,
  /// and whoever supervises must not be able to hold up the acquisition.
  static void notify(const std::string& state) {
    const char* path = std::getenv("NOTIFY_SOCKET");
    sockaddr_un address{};
    if (path == nullptr || std::string_view(path).size() >= sizeof(address.sun_path)) return;
    const std::string_view name(path);
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path, name.size());
    if (name.starts_with('@')) address.sun_path[0] = '\0';  // an abstract one
    const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    (void)::sendto(socket.get(), state.data(), state.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                   reinterpret_cast<const sockaddr*>(&address), size);
  }

  /// WATCHDOG_USEC, if it is meant for this process; else 0.
  static std::chrono::microseconds watchdog_interval() {
    const char* process = std::getenv("WATCHDOG_PID");
    const char* interval_us = std::getenv("WATCHDOG_USEC");
    if (interval_us == nullptr || (process != nullptr && std::atoi(process) != ::getpid())) {
      return std::chrono::microseconds(0);
    }
    return std::chrono::microseconds(std::max(0LL, std::atoll(interval_us)));
  }

  using Clock = std::chrono::steady_clock;
  [[nodiscard]] static int64_t now_us() {
    return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count();
  }

  std::chrono::microseconds interval_{0};  // 0: no watchdog
  int64_t next_beat_us_ = 0;
  std::atomic<int64_t> server_seen_us_ = 0;
};

}  // namespace diastole
