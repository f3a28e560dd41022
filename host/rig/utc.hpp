#pragma once
// The wall clock, for people.

#include <fmt/chrono.h>

#include <ctime>
#include <string>

namespace diastole {

/// "2026-11-21T09:04:00Z".
inline std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

}  // namespace diastole
