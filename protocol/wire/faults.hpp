#pragma once
// Numbered outcomes that cross the wire: latched faults, reasons for refusal, limits. One list file each.

#include <cstdint>

namespace diastole::wire {

#define DIASTOLE_FAULT(number, name, explanation, remedy) name = number,
enum class Fault : std::uint8_t {
#include "protocol/wire/fault_list.inc"
};
#undef DIASTOLE_FAULT
inline constexpr Fault kLastFault = Fault::home_switch_stuck;

#define DIASTOLE_REFUSAL(number, name, explanation) name = number,
enum class Refusal : std::uint8_t {
#include "protocol/wire/refusal_list.inc"
};
#undef DIASTOLE_REFUSAL
inline constexpr Refusal kLastRefusal = Refusal::waveforms_full;

#define DIASTOLE_LIMIT(number, name, unit) name = number,
enum class Limit : std::uint8_t {
#include "protocol/wire/limit_list.inc"
};
#undef DIASTOLE_LIMIT
inline constexpr Limit kLastLimit = Limit::trigger_delay;

}  // namespace diastole::wire
