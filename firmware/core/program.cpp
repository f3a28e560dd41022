#include "firmware/core/program.hpp"

namespace diastole::firmware {

Ticks Settings::ramp_time(Steps distance) const {
  const auto steps =
      static_cast<std::uint64_t>(distance.count < 0 ? -std::int64_t{distance.count} : distance.count);
  const std::uint64_t speed = ramp_steps_per_s();
  const std::uint64_t acceleration = stop_steps_per_s2();
  std::uint64_t time_ms = 1000;
  while (2000 * steps > speed * time_ms || 16'000'000 * steps > acceleration * time_ms * time_ms)
    time_ms += time_ms / 8;
  return microseconds(static_cast<std::int64_t>(time_ms * 1000));
}

}  // namespace diastole::firmware
