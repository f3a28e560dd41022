#pragma once
// Ctrl-C while a command works.

namespace diastole {

/// While it lives, the first Ctrl-C is a request to end at the next good place; the second ends the program at once.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Whether Ctrl-C came since the newest one was made.
  static bool requested();

 private:
  void (*before_)(int);
};

}  // namespace diastole
