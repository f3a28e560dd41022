#pragma once
// From a program to the times of its steps. The planner is a generator: peek() is the next event, pop() moves
// on; nothing is stored but the present place in the program.
//
//   start ─▶ [ramp to 0] ─▶ rest ─▶ ( [ramp to offset] ─▶ cycles ) for each segment ─▶ [ramp to 0] ─▶ end
//
// Cycle c of a segment that starts at s begins at s + c T exactly. Its stroke is N whole microsteps, and the
// step from level k to k + 1 is made when the ideal motion crosses the level half way between,
// y = (2k + 1) / 2N, rounded to a tick; so the position is the ideal one rounded to a microstep, and N steps
// up are followed by N steps down: nothing drifts. An uploaded waveform may turn more often; what it crosses and
// when is for UploadedCrossings to say. Ramps are rising halves of the parabolic profile. A segment
// that holds is approached by a ramp to offset + stroke; its cycles have no steps, but begin and trigger.

#include <cstdint>

#include "firmware/core/profiles/profile.hpp"
#include "firmware/core/program.hpp"
#include "firmware/core/rest_to_rest_move.hpp"
#include "firmware/core/stepped_fraction.hpp"
#include "firmware/core/units.hpp"
#include "firmware/core/uploaded/crossings.hpp"

namespace diastole::firmware {

/// Something that happens at a tick; flags combine.
struct MotionEvent {
  enum Flag : std::uint16_t {
    kStep = 1,           ///< an edge on STEP
    kInflate = 2,        ///< direction of that step
    kCycleStart = 4,     ///< first step of a cycle, or the beginning of one without: the TTL rises
    kRWave = 8,          ///< … and the R-wave starts
    kCycleEnd = 16,      ///< last step of a cycle, or just before the end of one without
    kRunStart = 32,      ///< run time zero; no step
    kSegmentStart = 64,  ///< first cycle of the next segment begins; no step
    kEnd = 128,          ///< everything planned has been done; no step
    kTriggerLost = 512,  ///< reported instead of a trigger whose TTL was not seen to rise
    kBacklash = 256,     ///< a step that takes up play: the motor moves, the load does not
  };
  Ticks tick;
  std::uint16_t flags = 0;  ///< 0: no event

  [[nodiscard]] bool has(Flag flag) const { return (flags & flag) != 0; }
};

class Planner {
 public:
  /// From the last event to the end of a stop that needs no step: two events cannot share a tick of the timer.
  static constexpr Ticks kRestBeforeEnd = microseconds(1'000);

  /// Plans the program from `start`. `program` must outlive the run. Precondition: check_program accepted it.
  void begin_run(const Program& program, const Settings& settings, Ticks start, Steps position);
  /// Plans one motion from rest to rest (homing, jog).
  void begin_move(bool inflate, const RestToRestMove& move, Ticks start);
  /// After the cycle being planned: ramp to 0 and end.
  void stop_at_cycle_end() { stop_at_cycle_end_ = true; }
  /// Comes to rest from the last popped event at no more than `deceleration_steps_per_s2`: what has been popped
  /// will happen, so everything planned from here lies after it as well as at or after `earliest`. With v = 1/Δ
  /// the speed between the last two steps, n = ⌈v²/2a - 1/2⌉ more steps bring rest after (2n + 1)Δ:
  /// t_k = (2n + 1) Δ (1 - √(1 - 2k/(2n + 1))). Where the program itself is at rest (n = 0) the end comes
  /// kRestBeforeEnd after the last event. Near a turning point the Δ of the past overstates the speed, so the
  /// stop may go one step beyond it. A run not begun still begins; one whose end has been popped ends as planned.
  /// `turning`: the motion is known to be at a turning point, n = 0.
  void begin_stop(Ticks earliest, std::uint64_t deceleration_steps_per_s2, bool turning = false);
  /// Forgets everything planned.
  void clear() { next_ = {}; }

  /// The next event, or nullptr when all have been popped. Ticks increase.
  [[nodiscard]] const MotionEvent* peek() const { return next_.flags != 0 ? &next_ : nullptr; }
  void pop() {
    before_last_ = last_;
    last_ = next_;
    plan_next();
  }

  /// When the first cycle of a segment begins, relative to the start of run, if the run starts at position 0.
  static Ticks segment_offset(const Program& program, const Settings& settings, std::size_t segment);

 private:
  enum class Phase : std::uint8_t { idle, run_start, rest, ramp, segment_start, cycles, move, stop, end };

  void plan_next();
  [[nodiscard]] Ticks last_interval() const;
  void plan_in_phase();
  void end_ramp();
  void end_steps(Ticks duration);
  void begin_segment();
  void begin_ramp(Steps to, Phase then);
  MotionEvent ramp_step();
  MotionEvent cycle_step();
  MotionEvent uploaded_step();
  MotionEvent still_cycle_mark();
  [[nodiscard]] std::uint16_t cycle_start_flags() const;
  MotionEvent move_step();
  MotionEvent stop_step();
  void finish_cycle();

  const Program* program_ = nullptr;
  Settings settings_;
  MotionEvent next_;
  Phase phase_ = Phase::idle;
  Phase after_ramp_ = Phase::idle;
  Ticks origin_;             ///< when the present ramp, cycle, move or stop began
  Steps position_;           ///< at the beginning of the present phase
  std::uint32_t index_ = 0;  ///< next step of the present phase
  std::uint32_t count_ = 0;  ///< steps of the present ramp, half cycle, move or stop
  SteppedFraction level_;    ///< y of the next step of the present ramp, cycle or stop
  bool inflate_ = false;
  Ticks length_;                      ///< of the ramp, cycle, move or stop
  const Profile* profile_ = nullptr;  ///< null: the segment's waveform was uploaded
  UploadedCrossings crossings_;       ///< of that one
  RestToRestMove move_;
  std::size_t segment_ = 0;
  std::uint32_t cycle_ = 0;  ///< in the segment
  std::uint64_t cycle_in_run_ = 0;
  bool stop_at_cycle_end_ = false;

  // The last two events popped, from which a stop takes its place and its speed.
  MotionEvent last_;
  MotionEvent before_last_;
};

}  // namespace diastole::firmware
