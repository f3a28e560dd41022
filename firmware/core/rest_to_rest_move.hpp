#pragma once
// From rest to rest over a number of steps: even acceleration, even speed, even deceleration.
//
//   With Δ the interval at even speed and n steps to reach it, the ramp lasts 2nΔ; step k is made when k + 1/2 steps
//   are due: t_k = 2nΔ √((2k + 1)/2n) while accelerating, Δ apart at even speed, and the mirror image at the end.
//   n = ⌈v²/2a⌉, or half the distance if that is less; then the speed reached is √(2an).

#include <cstdint>

#include "firmware/core/units.hpp"

namespace diastole::firmware {

/// ⌊√square⌋
std::uint64_t whole_root(std::uint64_t square);

class RestToRestMove {
 public:
  RestToRestMove() = default;
  /// At most the speed and the acceleration given. Precondition: speed and acceleration at least 1, speed at most
  /// 1e6, count at most 2^31 - 1.
  RestToRestMove(std::uint32_t count, std::uint64_t steps_per_s, std::uint64_t steps_per_s2);

  [[nodiscard]] std::uint32_t count() const { return count_; }
  /// When a step is made, from the start. Precondition: step < count().
  [[nodiscard]] Ticks time_of(std::uint32_t step) const;
  [[nodiscard]] Ticks duration() const {
    return ramp_time_ * 2 + interval_ * (std::int64_t{count_} - 2 * std::int64_t{ramp_});
  }

 private:
  [[nodiscard]] Ticks ramp_up(std::uint32_t step) const;

  std::uint32_t count_ = 0;
  std::uint32_t ramp_ = 0;  ///< steps of each ramp
  Ticks interval_;
  Ticks ramp_time_;
};

}  // namespace diastole::firmware
