#pragma once
// The controller's refusals in words: of a program, naming the experiment's segment; of a jog, naming the option.

#include <string>

#include "host/config/experiment.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole {

/// Throws InputError with the limit, what was asked and what is allowed.
[[noreturn]] void refuse_program(const Experiment& experiment, size_t segment, const wire::Nak& nak);
/// Precondition: a limit is exceeded.
[[noreturn]] void refuse_jog(const wire::Nak& nak);
std::string remedy_for(wire::Refusal refusal);

}  // namespace diastole
