#pragma once
// What the daemon reports to the program that supervises it (systemd; sd_notify(3)): that it is ready, that it is
// alive, that it stops. Without a supervisor (no NOTIFY_SOCKET) nothing is reported, and nothing else changes.
//
// The watchdog is fed by the acquisition loop, not by an idle thread: beat() is called wherever the loop goes
// to sleep, and passes the word on only while the server's thread has also been heard of within the interval.
// If either hangs, the supervisor ends the daemon; the pump then stops by its lease, and the daemon that is
// started anew moves nothing.

#include <atomic>
#include <chrono>
#include <string>

namespace diastole {

class ServiceManager {
 public:
  ServiceManager();

  void ready();
  void stopping();
  /// One line for `systemctl status`.
  void status(const std::string& text);

  /// Of the server's thread, at least every server_interval().
  void server_lives();
  /// Of the acquisition loop, as often as it likes.
  void beat();
  /// Work that does not sleep follows, and may take `patience` (writing a long run's file).
  void allow(std::chrono::microseconds patience);
  /// Back to the usual interval.
  void allow_no_more();

  [[nodiscard]] std::chrono::milliseconds server_interval() const;

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] static int64_t now_us();

  std::chrono::microseconds interval_{0};  // 0: no watchdog
  int64_t next_beat_us_ = 0;
  std::atomic<int64_t> server_seen_us_ = 0;
};

}  // namespace diastole
