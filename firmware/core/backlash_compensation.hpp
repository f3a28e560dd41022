#pragma once
// Taking up the play of screw and nut, between planner and step engine. The planner plans the *load*; whenever the
// load turns, the motor has to make so many steps more before it takes the load along. They are put between the
// planner's own steps, which keep their times:
//
//   load    ─╱‾‾‾╲─   turns: its last step up, then (here) its first step down
//   lag       ▂▅▂      b steps from rest to rest within the window that begins with that last step
//   motor   ─╱‾‾╲╲─   = load - lag
//
// Outside of the windows the load follows the plan to a microstep; within one it waits until the motor has caught up.
// The window W is the shortest in which b steps can be made with the acceleration that the motion leaves,
// W = 2 √(b / (allowed - peak)), at no more than a quarter of the step rate; check_compensation says how that is checked.
//
// After homing the play lies on the side of inflating: there load and motor agree.

#include <cstdint>

#include "firmware/core/planner.hpp"
#include "firmware/core/units.hpp"

namespace diastole::firmware {

/// The window in µs for b steps beside a motion that accelerates at `peak_steps_per_s2`; 0 for none, UINT32_MAX if
/// nothing of the allowed acceleration is left.
std::uint32_t compensation_window_us(std::uint32_t backlash_steps, std::uint64_t peak_steps_per_s2,
                                     const Settings& settings);

class BacklashCompensation {
 public:
  /// A motion begins at `start`. The play lies where the last motion left it.
  void begin(std::uint32_t backlash_steps, Ticks window, Ticks least_interval, Ticks start);
  /// The play lies on the side of inflating: the motor is where the load is.
  void home() { lag_ = target_ = 0; }

  /// The next event for the engine: the planner's (null: it has none), later by a least interval if a compensation step
  /// has just been made, or a compensation step that is due before it. Null: nothing.
  const MotionEvent* merge(const MotionEvent* planned);
  /// What merge() gave has been handed over; true if it was the planner's.
  bool pop();

  /// The load has come to its turning point and not left it yet.
  [[nodiscard]] bool turning() const { return steps_ > 0 && load_inflates_ == (target_ != 0); }
  /// Steps by which the motor is behind the load's count.
  [[nodiscard]] std::int32_t lag() const { return lag_; }

 private:
  void aim(std::int32_t target);
  [[nodiscard]] Ticks due() const;

  std::int32_t backlash_ = 0;
  Ticks window_;
  Ticks least_interval_;
  std::int32_t lag_ = 0;  ///< 0: on the side of inflating; backlash_: on that of withdrawing
  std::int32_t target_ = 0;
  std::uint32_t steps_ = 0;  ///< of the present compensation; 0: none
  std::uint32_t index_ = 0;  ///< next of them
  Ticks start_;
  Ticks last_tick_;
  bool last_was_ours_ = false;
  bool load_inflates_ = true;  ///< the last step of the load
  bool ours_ = false;          ///< what merge() gave
  MotionEvent event_;
};

}  // namespace diastole::firmware
