#pragma once
// What a controller measured of itself over loop-back wires, judged (docs/on-the-chip.md has wires and limits). Limits are
// what the chip's parts may do by their datasheet, added up.

#include <optional>
#include <string>
#include <vector>

#include "host/controller/clock_map.hpp"
#include "protocol/wire/self_test_messages.hpp"

namespace diastole {

/// Reports as the controller gave them; tick_rate_Hz is its clock's (Hello).
struct SelfTestReadings {
  double tick_rate_Hz = 0;
  std::vector<wire::SelfTestReport> pulses;
  std::vector<wire::SelfTestReport> levels;
  wire::SelfTestReport steps;
  wire::SelfTestReport supply;
  std::vector<ClockPair> clock;  ///< the controller's against the host's, over some seconds
};

struct SelfTestCheck {
  std::string name;                ///< ttl_count, ttl_late, ttl_jitter, ...
  std::string what;                ///< for people
  std::optional<double> measured;  ///< none: nothing was seen that could be measured
  double least = 0, most = 0;      ///< of what passes, inclusive
  std::string unit;
  std::string remedy;  ///< for when it does not pass

  [[nodiscard]] bool passed() const { return measured && *measured >= least && *measured <= most; }
};

/// Figures of the STM32F405/407's datasheet (DocID022152), at most. "Not verified": the sheet's page was not at hand; hold it
/// against the sheet of the part before a board is judged by it.
namespace datasheet {

/// DAC, offset at code 0x800, of 4096 at VREF+ = 3.6 V. Table "DAC characteristics", as quoted and met by users of the part in
/// the vendor's forum (12 to 13 mV measured with the output buffer on, which is off here).
inline constexpr double dac_offset_codes = 12, dac_offset_supply_V = 3.6;
/// DAC, integral non-linearity and gain. The same table; not verified.
inline constexpr double dac_nonlinearity_codes = 4, dac_gain_share = 0.005;
/// DAC, full scale to 4 codes, 50 pF and 5 kOhm at the buffer's output. The same table; not verified, and the buffer is off.
inline constexpr double dac_settling_us = 6;
/// ADC, total unadjusted error at 30 MHz and less than 10 kOhm: table 66 of revision 2, "ADC accuracy". The DAC without its buffer has
/// 15 kOhm, which a sampling of 28 cycles at 21 MHz makes up for (converter.hpp).
inline constexpr double adc_error_codes = 5;
/// VREFINT, -40 to 105 °C. Table "Embedded internal reference voltage"; not verified.
inline constexpr double least_reference_V = 1.18, usual_reference_V = 1.21, most_reference_V = 1.24;

}  // namespace datasheet

/// DAC codes at which the levels are asked for: 10 to 90 % of full scale, away from where a follower gives up.
inline constexpr std::uint16_t self_test_codes[] = {410, 1229, 2048, 2867, 3686};
inline constexpr int self_test_pulses = 16;
inline constexpr std::uint16_t self_test_steps = 2000;

/// Every check, in the order in which a person mends: wires and counts, times, levels, supply, clock. Precondition: readings of
/// self_test_pulses pulses, and of each of self_test_codes.
std::vector<SelfTestCheck> judge(const SelfTestReadings& readings);

}  // namespace diastole
