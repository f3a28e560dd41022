#pragma once
// The firmware's version is the project's (CMakeLists.txt of the root).

#include <cstdint>

namespace diastole::firmware {

inline constexpr std::uint8_t kVersionMajor = DIASTOLE_VERSION_MAJOR;
inline constexpr std::uint8_t kVersionMinor = DIASTOLE_VERSION_MINOR;
inline constexpr std::uint8_t kVersionPatch = DIASTOLE_VERSION_PATCH;

}  // namespace diastole::firmware
