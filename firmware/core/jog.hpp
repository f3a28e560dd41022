#pragma once
// Moving the piston by hand, so to speak: how far, how fast, and what is too much.

#include "firmware/core/plan_check.hpp"
#include "firmware/core/program.hpp"
#include "firmware/core/rest_to_rest_move.hpp"
#include "protocol/wire/motion_messages.hpp"

namespace diastole::firmware {

/// Homed, the target must lie within the travel, and the speed be that of Settings::hand_steps_per_s.
/// Unhomed, no more than the travel, at no more than the speed of homing. At least one microstep.
PlanRefusal check_jog(const wire::Jog& jog, const Settings& settings, bool position_known, Steps position);

/// Precondition: check_jog accepted it.
RestToRestMove jog_move(const wire::Jog& jog, const Settings& settings);

}  // namespace diastole::firmware
