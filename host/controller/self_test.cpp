#include "host/controller/self_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "protocol/signal/median.hpp"

namespace diastole {
namespace {

/// Output compare to pin one or two ticks, input synchroniser and edge detector two or three (RM0090 18.3.5), one for where in
/// the tick it falls; the firmware's own bound for a TTL "as ordered" (PulseTimer::kSynchroniser).
constexpr double most_ttl_late_ticks = 6;
/// The trigger from TIM5 to TIM3 takes one or two ticks of which kPulseDelay takes one back (RM0090 18.3.15), the captures one
/// each; the bring-up's bound.
constexpr double least_skew_ticks = -1, most_skew_ticks = 4;
/// All of it is clocked by one crystal, so it is always the same, but for the tick in which an edge is seen.
constexpr double most_jitter_ticks = 1;
/// The DAC settles, and the conversion that sees it is the second that ends after that, 1.9 µs each.
constexpr double most_r_wave_late_us = datasheet::dac_settling_us + 4;
/// What the board's regulator may give (bring-up, 1). R-wave heights are shares of it.
constexpr double least_supply_V = 3.2, most_supply_V = 3.4;
/// Offset of the follower (MCP6001: 4.5 mV), where a code is smallest.
constexpr double follower_codes = 0.0045 * 4096 / least_supply_V;
/// An offset of the DAC is a voltage: of more codes the lower the supply.
constexpr double level_error_codes =
    datasheet::dac_offset_codes * datasheet::dac_offset_supply_V / least_supply_V +
    datasheet::dac_nonlinearity_codes + follower_codes + datasheet::adc_error_codes;
/// The board's crystal, and what time synchronisation may slew the host's clock by (MAXFREQ of adjtimex).
constexpr double crystal_ppm = 50, slewed_ppm = 500;

const char* const ttl_wire =
    "Put a wire from PA1 (TTL) to PA5, as short as the one from PA6 to PA3. If it is there, something holds "
    "PA1: take off whatever else is on it.";
const char* const step_wire = "Put a wire from PA6 (STEP) to PA3.";
const char* const r_wave_wire = "Put a wire from PA4 (R-wave), or from behind its follower, to PC3.";

struct Range {
  double least = 0, most = 0;
};

/// Of what was seen; none if nothing was.
std::optional<Range> range_of(std::span<const wire::SelfTestReport> pulses, auto&& value) {
  std::optional<Range> range;
  for (const wire::SelfTestReport& pulse : pulses) {
    const std::optional<double> found = value(pulse);
    if (!found) continue;
    if (!range) range = Range{*found, *found};
    range = Range{std::min(range->least, *found), std::max(range->most, *found)};
  }
  return range;
}

std::optional<double> seen(int32_t ticks) {
  return ticks == wire::kNotSeen ? std::nullopt : std::optional<double>(ticks);
}

/// The end of the range that is nearer to its limit, or further beyond it.
std::optional<double> worst(const std::optional<Range>& range, double least, double most) {
  if (!range) return {};
  return range->least - least < most - range->most ? range->least : range->most;
}

std::optional<double> width(const std::optional<Range>& range) {
  return range ? std::optional(range->most - range->least) : std::nullopt;
}

std::optional<double> scaled(const std::optional<double>& value, double factor) {
  return value ? std::optional(*value * factor) : std::nullopt;
}

class Judge {
 public:
  explicit Judge(const SelfTestReadings& readings)
      : readings_(readings), tick_ns_(1e9 / readings.tick_rate_Hz) {}

  std::vector<SelfTestCheck> checks() {
    count_pulses();
    time_pulses();
    count_steps();
    for (const wire::SelfTestReport& level : readings_.levels)
      compare_level(level);
    weigh_supply();
    compare_clocks();
    return std::move(checks_);
  }

 private:
  void count_pulses() {
    const auto& pulses = readings_.pulses;
    const auto all = static_cast<double>(pulses.size());
    const auto once =
        std::ranges::count_if(pulses, [](const wire::SelfTestReport& pulse) { return pulse.counted == 1; });
    const bool repeated =
        std::ranges::any_of(pulses, [](const wire::SelfTestReport& pulse) { return pulse.counted > 1; });
    add({"ttl_count", "TTLs seen once", static_cast<double>(once), all, all,
         fmt::format("of {}", pulses.size()),
         repeated ? "Edges come more than once: a loose or long wire; put a ground wire beside it."
                  : ttl_wire});
    const auto steps = std::ranges::count_if(
        pulses, [](const wire::SelfTestReport& pulse) { return pulse.step_late_ticks != wire::kNotSeen; });
    add({"step_seen", "STEPs seen beside them", static_cast<double>(steps), all, all,
         fmt::format("of {}", pulses.size()), step_wire});
  }
  void time_pulses() {
    const auto ttl = range_of(readings_.pulses, [](const auto& pulse) { return seen(pulse.ttl_late_ticks); });
    const char* const late =
        "Nothing but a wire may lie between PA1 and PA5; with that, the chip's timers are not as described.";
    add_ticks("ttl_late", "TTL after its tick", worst(ttl, 0, most_ttl_late_ticks), 0, most_ttl_late_ticks,
              ttl ? late : ttl_wire);
    add_ticks("ttl_jitter", "TTL's jitter", width(ttl), 0, most_jitter_ticks,
              ttl ? "The TTL is not moved by the timer alone: do not use this board." : ttl_wire);
    const auto skew = range_of(readings_.pulses, [](const auto& pulse) -> std::optional<double> {
      const auto step = seen(pulse.step_late_ticks), its_ttl = seen(pulse.ttl_late_ticks);
      return step && its_ttl ? std::optional(*step - *its_ttl) : std::nullopt;
    });
    const char* const no_skew = "Both wires are needed: PA6 to PA3 and PA1 to PA5.";
    add_ticks("step_skew", "STEP after TTL", worst(skew, least_skew_ticks, most_skew_ticks), least_skew_ticks,
              most_skew_ticks,
              skew ? "Make both wires alike; if it stays constant, put it into kPulseDelay of the firmware."
                   : no_skew);
    add_ticks("step_jitter", "its jitter", width(skew), 0, 2 * most_jitter_ticks,
              skew ? "STEP is not moved by the timer alone: do not use this board." : no_skew);
    const auto r_wave =
        range_of(readings_.pulses, [](const auto& pulse) { return seen(pulse.r_wave_late_ticks); });
    add({"r_wave_late", "R-wave after its tick",
         scaled(worst(r_wave, 0, 1e3 * most_r_wave_late_us / tick_ns_), 1e-3 * tick_ns_), 0,
         most_r_wave_late_us, "us",
         r_wave ? "Take capacitors off the wire between PA4 and PC3; measure in front of the divider."
                : r_wave_wire});
  }
  void count_steps() {
    const wire::SelfTestReport& steps = readings_.steps;
    add({"step_count", "STEPs counted", static_cast<double>(steps.counted),
         static_cast<double>(steps.argument), static_cast<double>(steps.argument),
         fmt::format("of {}", steps.argument),
         steps.counted == 0
             ? step_wire
             : "Pulses are lost or doubled: a loose or long wire; put a ground wire beside it."});
  }
  void compare_level(const wire::SelfTestReport& level) {
    const double asked = level.argument;
    const double error = level_error_codes + datasheet::dac_gain_share * asked;
    const double most_code = wire::kMostCode;
    const bool nothing = level.code < level_error_codes;
    add({fmt::format("level_{:.0f}", 100 * asked / most_code),
         fmt::format("R-wave's output at {:.0f} %", 100 * asked / most_code), level.code,
         std::round(asked - error), std::round(asked + error), "codes",
         nothing ? r_wave_wire
                 : "Measure between PA4 and ground: a follower that reaches from 0 V to the supply, no "
                   "divider, no load."});
  }
  void weigh_supply() {
    const double code = readings_.supply.code;
    const auto supply_of = [](double reference_code) {
      return datasheet::usual_reference_V * wire::kMostCode / reference_code;
    };
    const auto code_at = [](double supply_V, double reference_V) {
      return reference_V / supply_V * wire::kMostCode;
    };
    add({"supply", "supply by the chip's reference", code > 0 ? std::optional(supply_of(code)) : std::nullopt,
         supply_of(code_at(least_supply_V, datasheet::most_reference_V) + datasheet::adc_error_codes),
         supply_of(code_at(most_supply_V, datasheet::least_reference_V) - datasheet::adc_error_codes), "V",
         "Measure the board's 3.3 V: R-waves are as much too high or too low as it is."});
  }
  void compare_clocks() {
    const auto& pairs = readings_.clock;
    const auto map = pairs.size() < 3 ? std::nullopt : fit_clock_map(pairs);
    const double span_s = map ? pairs.back().host_s - pairs.front().host_s : 0;
    std::vector<double> trips_s;
    for (const ClockPair& pair : pairs)
      trips_s.push_back(pair.uncertainty_s);
    // Each end of the line is known to half of a usual round trip.
    const double known_ppm = span_s < 1 ? 0 : 2e6 * signal::median(std::move(trips_s)) / span_s;
    const double most_ppm = crystal_ppm + slewed_ppm + known_ppm;
    add({"clock", "clock against the host's", span_s < 1 ? std::nullopt : std::optional(map->drift_ppm()),
         -most_ppm, most_ppm, "ppm",
         "Another crystal than the firmware's, or a host's clock that is being set: see `timedatectl`, then "
         "try again."});
  }
  void add_ticks(const char* name, const char* what, const std::optional<double>& ticks, double least,
                 double most, const char* remedy) {
    add({name, what, scaled(ticks, tick_ns_), least * tick_ns_, most * tick_ns_, "ns", remedy});
  }
  void add(SelfTestCheck check) { checks_.push_back(std::move(check)); }

  const SelfTestReadings& readings_;
  double tick_ns_;
  std::vector<SelfTestCheck> checks_;
};

}  // namespace

std::vector<SelfTestCheck> judge(const SelfTestReadings& readings) { return Judge(readings).checks(); }

}  // namespace diastole
