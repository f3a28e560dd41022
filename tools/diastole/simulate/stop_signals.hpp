#pragma once
// Ctrl-C for a command that runs a session by itself.

#include <csignal>

namespace diastole {

/// While it lives, Ctrl-C stops the session at the cycle's end, a second one or SIGTERM stops it now. One at a time.
class StopSignals {
 public:
  StopSignals() {
    asked_ = 0;
    std::signal(SIGINT, [](int) { asked_ = asked_ + 1; });
    for (const int number : {SIGTERM, SIGHUP})
      std::signal(number, [](int) { asked_ = 2; });
  }
  ~StopSignals() {
    for (const int number : {SIGINT, SIGTERM, SIGHUP})
      std::signal(number, SIG_DFL);
  }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// How often the user has asked.
  [[nodiscard]] int asked() const { return asked_; }

 private:
  inline static volatile std::sig_atomic_t asked_ = 0;
};

}  // namespace diastole
