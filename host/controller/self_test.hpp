#pragma once
// What a controller measured of itself over loop-back wires, judged (docs/on-the-chip.md has wires and limits). Limits are
// what the chip's parts may do by their datasheet, added up; each stands beside its reason in self_test.cpp.

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

/// DAC codes at which the levels are asked for: 10 to 90 % of full scale, away from where a follower gives up.
inline constexpr std::uint16_t self_test_codes[] = {410, 1229, 2048, 2867, 3686};
inline constexpr int self_test_pulses = 16;
inline constexpr std::uint16_t self_test_steps = 2000;

/// Every check, in the order in which a person mends: wires and counts, times, levels, supply, clock. Precondition: readings of
/// self_test_pulses pulses, and of each of self_test_codes.
std::vector<SelfTestCheck> judge(const SelfTestReadings& readings);

}  // namespace diastole
