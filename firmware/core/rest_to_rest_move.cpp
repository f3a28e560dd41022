#include "firmware/core/rest_to_rest_move.hpp"

#include <algorithm>

#include "firmware/core/arithmetic/fixed_point.hpp"

namespace diastole::firmware {

std::uint64_t whole_root(std::uint64_t square) {
  std::uint64_t root = 0;
  for (std::uint64_t bit = std::uint64_t{1} << 31; bit > 0; bit >>= 1)
    if ((root | bit) * (root | bit) <= square) root |= bit;
  return root;
}

RestToRestMove::RestToRestMove(std::uint32_t count, std::uint64_t steps_per_s, std::uint64_t steps_per_s2)
    : count_(count) {
  std::uint64_t speed = steps_per_s;
  const std::uint64_t wanted = (speed * speed + 2 * steps_per_s2 - 1) / (2 * steps_per_s2);
  ramp_ = static_cast<std::uint32_t>(std::min<std::uint64_t>(wanted, count / 2));
  if (ramp_ < wanted)
    speed = std::min(speed, whole_root(std::max<std::uint64_t>(2 * steps_per_s2 * ramp_, steps_per_s2 / 4)));
  speed = std::max<std::uint64_t>(speed, 1);
  interval_ =
      Ticks{static_cast<std::int64_t>((static_cast<std::uint64_t>(kTicksPerSecond) + speed - 1) / speed)};
  ramp_time_ = interval_ * (2 * std::int64_t{ramp_});
}

Ticks RestToRestMove::ramp_up(std::uint32_t step) const {
  const Q64 part = square_root(ratio(2 * step + 1, 2 * ramp_));
  return {static_cast<std::int64_t>(scale(static_cast<std::uint64_t>(ramp_time_.count), part))};
}

Ticks RestToRestMove::time_of(std::uint32_t step) const {
  if (step < ramp_) return ramp_up(step);
  if (step >= count_ - ramp_) return duration() - ramp_up(count_ - 1 - step);
  return ramp_time_ + interval_ * (std::int64_t{step} - std::int64_t{ramp_}) + Ticks{interval_.count / 2};
}

}  // namespace diastole::firmware
