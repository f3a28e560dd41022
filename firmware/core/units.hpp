#pragma once
// Counts that must not be mixed up: ticks of the controller's clock and microsteps of the motor.

#include <compare>
#include <cstdint>

namespace diastole::firmware {

template <class Tag, class Integer>
struct Count {
  Integer count = 0;

  constexpr auto operator<=>(const Count&) const = default;
  constexpr Count operator+(Count other) const { return {static_cast<Integer>(count + other.count)}; }
  constexpr Count operator-(Count other) const { return {static_cast<Integer>(count - other.count)}; }
  constexpr Count operator-() const { return {static_cast<Integer>(-count)}; }
  constexpr Count& operator+=(Count other) { return *this = *this + other; }
  constexpr Count& operator-=(Count other) { return *this = *this - other; }
  constexpr Count operator*(Integer factor) const { return {static_cast<Integer>(count * factor)}; }
};

/// Time since reset, or a duration, in ticks of 1/84 µs.
using Ticks = Count<struct TicksTag, std::int64_t>;
/// Microsteps from the home position; inflate is positive.
using Steps = Count<struct StepsTag, std::int32_t>;

// TIM2 of the STM32F405 runs at 84 MHz (APB1 timer clock with the core at 168 MHz): 11.9 ns a tick, and 84
// ticks are one microsecond exactly, so that periods given in µs never drift.
inline constexpr std::int64_t kTicksPerMicrosecond = 84;
inline constexpr std::int64_t kTicksPerSecond = 84'000'000;

constexpr Ticks microseconds(std::int64_t count) { return {count * kTicksPerMicrosecond}; }

/// The lower half of a time, as a 32-bit counter shows it: distinguishes moments that lie within 25 s.
constexpr std::uint32_t lower_half(Ticks time) { return static_cast<std::uint32_t>(time.count); }
/// From one lower half to another, positive if `to` is later.
constexpr std::int32_t ticks_between(std::uint32_t from, std::uint32_t to) {
  return static_cast<std::int32_t>(to - from);
}
/// The time near `near` that has this lower half.
constexpr Ticks whole_time(std::uint32_t lower, Ticks near) {
  return near + Ticks{ticks_between(lower_half(near), lower)};
}

/// Ticks as messages carry them.
constexpr std::uint64_t on_wire(Ticks ticks) { return static_cast<std::uint64_t>(ticks.count); }

}  // namespace diastole::firmware
