#pragma once
// What the controller says, for people: its refusals, naming the experiment's segment or the option; the entries of its
// black box; and, where this program and its firmware do not speak the same protocol, which of the two is to be updated,
// and how.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "host/config/experiment.hpp"
#include "protocol/wire/black_box_messages.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/session_messages.hpp"

namespace diastole {

/// Throws InputError with the limit, what was asked and what is allowed.
[[noreturn]] void refuse_program(const Experiment& experiment, size_t segment, const wire::Nak& nak);
/// Precondition: a limit is exceeded.
[[noreturn]] void refuse_jog(const wire::Nak& nak);
std::string remedy_for(wire::Refusal refusal);

/// "fault 1 (estop): The emergency stop was pressed; ..."
std::string in_words(const wire::BlackBoxEntry& entry);

/// Major, minor, patch.
using ProgramVersion = std::array<uint8_t, 3>;

/// Of this program.
extern const ProgramVersion own_version;

struct VersionMismatch {
  std::string problem;  ///< names both versions and both protocols
  std::string remedy;   ///< a command
};

/// Nothing if the protocols agree. The one with the lower version is to be updated; of two equal versions that do not
/// agree the firmware is, as it is what the program brings along.
std::optional<VersionMismatch> compare_versions(const wire::Hello& firmware, const ProgramVersion& program,
                                                uint32_t program_schema, const std::string& port);

}  // namespace diastole
