#include "firmware/core/backlash_compensation.hpp"

#include <algorithm>

#include "firmware/core/arithmetic/fixed_point.hpp"
#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

std::uint32_t compensation_window_us(std::uint32_t backlash_steps, std::uint64_t peak_steps_per_s2,
                                     const Settings& settings) {
  if (backlash_steps == 0) return 0;
  const std::uint64_t allowed = settings.stop_steps_per_s2();
  constexpr std::uint64_t most_steps = 1'000'000;
  if (peak_steps_per_s2 >= allowed || backlash_steps > most_steps) return UINT32_MAX;
  const std::uint64_t by_acceleration_us =
      whole_root(4'000'000'000'000 * backlash_steps / (allowed - peak_steps_per_s2)) + 1;
  const std::uint64_t by_rate_us =
      std::uint64_t{8'000'000} * backlash_steps / std::max<std::uint32_t>(settings.limits().step_rate_Hz, 1) +
      1;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(std::max(by_acceleration_us, by_rate_us), UINT32_MAX));
}

void BacklashCompensation::begin(std::uint32_t backlash_steps, Ticks window, Ticks least_interval,
                                 Ticks start) {
  backlash_ = static_cast<std::int32_t>(backlash_steps);
  window_ = window;
  least_interval_ = least_interval;
  last_tick_ = start;
  last_was_ours_ = false;
  steps_ = 0;
  target_ = lag_;
  load_inflates_ = lag_ == 0;
}

void BacklashCompensation::aim(std::int32_t target) {
  target_ = target;
  steps_ = static_cast<std::uint32_t>(target_ > lag_ ? target_ - lag_ : lag_ - target_);
  index_ = 0;
  start_ = last_tick_;
}

Ticks BacklashCompensation::due() const {
  const Q64 phase = parabolic_profile.phase_rising(ratio(2 * index_ + 1, 2 * steps_));
  const Ticks ideal{static_cast<std::int64_t>(scale(static_cast<std::uint64_t>(window_.count) * 2, phase))};
  return std::max(start_ + ideal, last_tick_ + least_interval_);
}

const MotionEvent* BacklashCompensation::merge(const MotionEvent* planned) {
  if (planned != nullptr && planned->has(MotionEvent::kStep)) {
    const std::int32_t target = planned->has(MotionEvent::kInflate) ? 0 : backlash_;
    if (target != target_ || (steps_ == 0 && lag_ != target)) aim(target);
  }
  if (steps_ > 0) {
    const Ticks tick = due();
    const bool last = planned == nullptr || planned->has(MotionEvent::kEnd);
    ours_ = last || tick + least_interval_ <= planned->tick;
    if (ours_) {
      const std::uint16_t way = target_ < lag_ ? MotionEvent::kInflate : 0;
      event_ = {tick, static_cast<std::uint16_t>(MotionEvent::kStep | MotionEvent::kBacklash | way)};
      return &event_;
    }
  }
  ours_ = false;
  if (planned == nullptr) return nullptr;
  event_ = *planned;
  if (last_was_ours_) {
    const Ticks gap = planned->has(MotionEvent::kEnd) ? Planner::kRestBeforeEnd : least_interval_;
    event_.tick = std::max(event_.tick, last_tick_ + gap);
  }
  return &event_;
}

bool BacklashCompensation::pop() {
  last_tick_ = event_.tick;
  last_was_ours_ = ours_;
  if (ours_) {
    lag_ += target_ > lag_ ? 1 : -1;
    if (++index_ == steps_) steps_ = 0;
    return false;
  }
  if (event_.has(MotionEvent::kStep)) load_inflates_ = event_.has(MotionEvent::kInflate);
  return true;
}

}  // namespace diastole::firmware
