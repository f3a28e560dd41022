#pragma once
// Whether this program and the firmware that it meets speak the same protocol; if not, which of the two is to be
// updated, and how.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "protocol/wire/session_messages.hpp"

namespace diastole {

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
