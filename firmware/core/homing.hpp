#pragma once
// Finding position 0: withdraw until the home switch closes, leave it slowly until it opens, go on by a
// fixed clearance, and call that 0. A rig that already stands on the switch begins with leaving it.
//
//     far limit                        position 0   switch opens
//        |·································|<-- 64 -->|####### home switch closed
//   inflate ◀──                                        ──▶ withdraw

#include <algorithm>
#include <cstdint>

#include "firmware/core/program.hpp"
#include "firmware/core/units.hpp"

namespace diastole::firmware {

enum class HomingStage : std::uint8_t { seek, leave, clearance, done };

inline constexpr std::uint32_t kHomeClearance_steps = 64;
/// At rest between two stages.
inline constexpr Ticks kHomingPause = microseconds(100'000);

struct HomingTravel {
  bool inflate = false;
  std::uint32_t most_steps = 0;  ///< the switch must have changed by then
  Ticks interval;
};

/// Seeking goes at the configured speed over a tenth more than the travel, the rest at a quarter of that
/// speed.
inline HomingTravel homing_travel(HomingStage stage, const Settings& settings) {
  const wire::Configure& limits = settings.limits();
  const std::uint64_t travel = std::uint64_t{limits.travel_uL} * 1'000'000 / limits.microstep_pL + 1;
  const std::uint64_t speed = std::clamp<std::uint64_t>(settings.steps_per_s(limits.homing_flow_uL_per_s), 1,
                                                        settings.allowed_steps_per_s());
  const Ticks fast{static_cast<std::int64_t>(static_cast<std::uint64_t>(kTicksPerSecond) / speed)};
  const auto steps = [](std::uint64_t count) {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(count, 2'000'000'000));
  };
  switch (stage) {
    case HomingStage::seek:
      return {false, steps(travel + travel / 10), fast};
    case HomingStage::leave:
      return {true, steps(travel / 20 + 1000), fast * 4};
    default:
      return {true, kHomeClearance_steps, fast * 4};
  }
}

}  // namespace diastole::firmware
