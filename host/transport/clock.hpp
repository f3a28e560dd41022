#pragma once
// The time that acquisition lives in. Whoever polls the instrument, times heart-beats or stamps samples asks
// a Clock, so that a simulated rig can conduct time (protocol/contract/conductor.hpp) and tests can script
// it.

#include <poll.h>
#include <time.h>

#include <cstdint>

#include "host/transport/byte_line.hpp"

namespace diastole {

class Clock {
 public:
  virtual ~Clock() = default;

  [[nodiscard]] virtual uint64_t now_ns() = 0;
  /// Returns when now_ns() has reached until_ns; in real time also as soon as `line` (may be null) has input.
  virtual void sleep_until_ns(uint64_t until_ns, ByteLine* line) = 0;
  /// Notifies the clock that `line` was just opened, before anything is written to it.
  virtual void line_opened(ByteLine& /*line*/) {}
  /// True if time moves only inside sleep_until_ns: then it must not be passed idly.
  [[nodiscard]] virtual bool stands_still() const { return false; }
};

/// CLOCK_MONOTONIC.
class RealClock final : public Clock {
 public:
  [[nodiscard]] uint64_t now_ns() override {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<uint64_t>(now.tv_sec) * ns_per_s + static_cast<uint64_t>(now.tv_nsec);
  }
  void sleep_until_ns(uint64_t until_ns, ByteLine* line) override {
    const uint64_t now = now_ns();
    if (until_ns <= now) return;
    const uint64_t left = until_ns - now;
    const timespec timeout{static_cast<time_t>(left / ns_per_s), static_cast<long>(left % ns_per_s)};
    const bool watched = line != nullptr && !line->lost() && line->descriptor() >= 0;
    pollfd state{watched ? line->descriptor() : -1, POLLIN, 0};
    ppoll(&state, watched ? 1 : 0, &timeout, nullptr);
  }

 private:
  static constexpr uint64_t ns_per_s = 1'000'000'000;
};

}  // namespace diastole
