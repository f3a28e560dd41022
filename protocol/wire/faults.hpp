#pragma once
// Numbered outcomes that cross the wire: latched faults, reasons for refusal, limits. One list file each.

#include <cstdint>

#include "protocol/wire/last_of.hpp"

namespace diastole::wire {

#define DIASTOLE_FAULT(number, name, explanation, remedy) name = number,
enum class Fault : std::uint8_t {
#include "protocol/wire/fault_list.inc"
};
#define DIASTOLE_FAULT(number, name, explanation, remedy) Fault::name,
inline constexpr Fault kLastFault = last_of({
#include "protocol/wire/fault_list.inc"
});

#define DIASTOLE_REFUSAL(number, name, explanation) name = number,
enum class Refusal : std::uint8_t {
#include "protocol/wire/refusal_list.inc"
};
#define DIASTOLE_REFUSAL(number, name, explanation) Refusal::name,
inline constexpr Refusal kLastRefusal = last_of({
#include "protocol/wire/refusal_list.inc"
});

#define DIASTOLE_LIMIT(number, name, unit) name = number,
enum class Limit : std::uint8_t {
#include "protocol/wire/limit_list.inc"
};
#define DIASTOLE_LIMIT(number, name, unit) Limit::name,
inline constexpr Limit kLastLimit = last_of({
#include "protocol/wire/limit_list.inc"
});

}  // namespace diastole::wire
