#pragma once
// Finding position 0, in five stages from rest to rest, so that every homing ends with the same slow movements
// whatever came before:
//
//   seek       withdraw fast until the home switch closes, come to rest
//   back_off   inflate fast until it opens again, come to rest
//   approach   withdraw slowly until it closes
//   leave      inflate slowly until it opens: the reference
//   clearance  go on by a fixed distance, in any case more than the play, and call that 0
//
//     far limit                        position 0   switch opens
//        |·································|<-- 64 -->|####### home switch closed
//   inflate ◀──                                        ──▶ withdraw
//
// A rig that already stands on the switch begins with back_off. A far limit switch that closes on the way cuts the motor
// off: it turns the wrong way. The reference is found while inflating, so the play
// of screw and nut is on the side from which every cycle begins, and the switch's hysteresis does not matter. Slow is
// slow enough to stop within a step: the switch's interrupt ends approach and leave; from the fast stages the motor
// comes to rest under control and may go v · 10 ms + v²/2a beyond the switch.

#include <algorithm>
#include <cstdint>

#include "firmware/core/program.hpp"
#include "firmware/core/rest_to_rest_move.hpp"
#include "firmware/core/units.hpp"

namespace diastole::firmware {

enum class HomingStage : std::uint8_t { seek, back_off, approach, leave, clearance, stopped, done };

inline constexpr std::uint32_t kHomeClearance_steps = 64;
/// At rest between two stages.
inline constexpr Ticks kHomingPause = microseconds(100'000);

struct HomingMove {
  bool inflate = false;
  RestToRestMove move;  ///< as far as the switch may be away
};

/// Fast is the configured speed as far as hand_steps_per_s allows, slow a quarter of it or what stops within a step. The switch must be found within a
/// tenth more than the travel, and open within a twentieth of it.
inline HomingMove homing_move(HomingStage stage, const Settings& settings, std::uint32_t backlash_steps) {
  const wire::Configure& limits = settings.limits();
  const std::uint64_t travel = std::uint64_t{limits.travel_uL} * 1'000'000 / limits.microstep_pL + 1;
  const std::uint64_t acceleration = settings.stop_steps_per_s2();
  const std::uint64_t fast = std::clamp<std::uint64_t>(settings.steps_per_s(limits.homing_flow_uL_per_s), 1,
                                                       settings.hand_steps_per_s());
  const std::uint64_t slow = std::max<std::uint64_t>(std::min(fast / 4, whole_root(acceleration)), 1);
  const auto move = [&](bool inflate, std::uint64_t steps, std::uint64_t speed) {
    return HomingMove{
        inflate,
        {static_cast<std::uint32_t>(std::min<std::uint64_t>(steps, 2'000'000'000)), speed, acceleration}};
  };
  const std::uint64_t near = travel / 20 + 1000;
  switch (stage) {
    case HomingStage::seek:
      return move(false, travel + travel / 10, fast);
    case HomingStage::back_off:
      return move(true, near, fast);
    case HomingStage::approach:
      return move(false, near, slow);
    case HomingStage::leave:
      return move(true, near, slow);
    default:
      return move(true, std::max(kHomeClearance_steps, backlash_steps + 16), slow);
  }
}

}  // namespace diastole::firmware
