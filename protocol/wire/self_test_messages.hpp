#pragma once
// What a board measures of its own outputs over loop-back wires (docs/on-the-chip.md). One measurement a request, a
// fraction of a second each; the host asks for as many as it wants and judges them.
//
//   item    argument   measures
//   pulse   -          one STEP, one TTL and the R-wave's beginning, ordered for the same tick: when each was seen to rise
//   steps   pulses     so many STEP pulses, 10 µs apart: how many a counter has seen
//   level   DAC code   holds the R-wave's output at that code: what the converter reads
//   supply  -          the converter's reading of the chip's own reference of 1.21 V: the supply is its full scale
//
// STEP pulses go to the driver too: refused while the motor is powered, and while anything moves or is armed. Afterwards
// every pin and register is as it was; neither position nor counters have changed.

#include <cstdint>
#include <limits>

#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/last_of.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole::wire {

#define DIASTOLE_SELF_TEST(number, name) name = number,
enum class SelfTestItem : std::uint8_t {
#include "protocol/wire/self_test_item_list.inc"
};
#define DIASTOLE_SELF_TEST(number, name) SelfTestItem::name,
inline constexpr SelfTestItem kLastSelfTestItem = last_of({
#include "protocol/wire/self_test_item_list.inc"
});

/// Full scale of DAC and converter.
inline constexpr std::uint16_t kMostCode = 4095;
/// Of a SelfTestReport: nothing was seen.
inline constexpr std::int32_t kNotSeen = std::numeric_limits<std::int32_t>::min();

// clang-format off

// Host → controller: answer with SelfTestReport.
//
// Example SelfTest: 07 01 02 00 08
struct SelfTest {
  DIASTOLE_LAYOUT(SelfTest,
      (value,  0, uint16_t, request_id),                            // chosen by the host; the answer repeats it
      (choice, 2, SelfTestItem, item, kLastSelfTestItem),
      (within, 3, uint16_t, argument, 0U, kMostCode))               // DAC code, or STEP pulses
  static constexpr SelfTest example() {
    return {.request_id = 0x0107, .item = SelfTestItem::level, .argument = 2048};
  }
};

// Controller → host, the answer to SelfTest. What the item does not measure is 0. Ticks are those from the tick that was
// ordered to the rise as captured; INT32_MIN: it was not seen.
//
// Example SelfTestReport: 07 01 00 00 00 01 00 00 00 02 00 00 00 03 00 00 00 96 00 00 00
struct SelfTestReport {
  DIASTOLE_LAYOUT(SelfTestReport,
      (value,   0, uint16_t, request_id),                           // chosen by the host; the answer repeats it
      (choice,  2, SelfTestItem, item, kLastSelfTestItem),
      (value,   3, uint16_t, argument),                             // as asked
      (value,   5, uint16_t, counted),                              // pulse: rises of the TTL, 2: more than one; steps: STEP pulses
      (value,   7, uint16_t, code),                                 // level, supply: mean of 16 readings of the converter
      (value,   9, int32_t, ttl_late_ticks),                        // pulse
      (value,  13, int32_t, step_late_ticks),                       // pulse
      (value,  17, int32_t, r_wave_late_ticks))                     // pulse: end of the first conversion above half of the step
  static constexpr SelfTestReport example() {
    return {.request_id = 0x0107,
            .item = SelfTestItem::pulse,
            .counted = 1,
            .ttl_late_ticks = 2,
            .step_late_ticks = 3,
            .r_wave_late_ticks = 150};
  }
};

// clang-format on

}  // namespace diastole::wire
