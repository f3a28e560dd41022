#pragma once
// Plain words for what the controller says in numbers. Host programs only: not part of the firmware image.

#include <string_view>

#include "protocol/wire/black_box_messages.hpp"
#include "protocol/wire/faults.hpp"
#include "protocol/wire/states.hpp"
#include "protocol/wire/update.hpp"

namespace diastole::wire {

std::string_view fault_name(Fault fault);
std::string_view fault_explanation(Fault fault);
std::string_view fault_remedy(Fault fault);
std::string_view refusal_name(Refusal refusal);
std::string_view refusal_explanation(Refusal refusal);
std::string_view limit_name(Limit limit);
std::string_view state_name(State state);
std::string_view waveform_name(Waveform waveform);
std::string_view run_end_name(RunEnd reason);
std::string_view noted_name(Noted kind);
std::string_view crash_register_name(CrashRegister which);
/// "{}" in it stands for UpdateAnswer.value.
std::string_view update_outcome_explanation(UpdateOutcome outcome);
std::string_view update_outcome_remedy(UpdateOutcome outcome);

}  // namespace diastole::wire
