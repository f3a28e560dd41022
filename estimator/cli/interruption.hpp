#pragma once
// Ctrl-C while a command works.

#include <csignal>

namespace diastole {

/// While it lives, the first Ctrl-C is a request to end at the next good place; the second ends the program at once.
class Interruption {
 public:
  Interruption() {
    came_ = 0;
    before_ = std::signal(SIGINT, [](int) {
      came_ = 1;
      std::signal(SIGINT, SIG_DFL);
    });
  }
  ~Interruption() { std::signal(SIGINT, before_); }
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Whether Ctrl-C came since the newest one was made.
  static bool requested() { return came_ != 0; }

 private:
  inline static volatile std::sig_atomic_t came_ = 0;
  void (*before_)(int);
};

}  // namespace diastole
