#include "tools/sim_rig/timeline.hpp"

#include <algorithm>

namespace diastole::sim_rig {

std::optional<Timeline::Due> Timeline::take_switch(const RunClock& clock, uint64_t until_ns) {
  auto first = switches_.end();
  uint64_t first_ns = until_ns;
  for (auto at = switches_.begin(); at != switches_.end(); ++at) {
    const auto due_ns = clock.at_ns(at->when);
    if (!due_ns || *due_ns > until_ns) continue;
    if (first != switches_.end() && *due_ns >= first_ns) continue;
    first = at;
    first_ns = *due_ns;
  }
  if (first == switches_.end()) return std::nullopt;
  const Due due{first_ns, *first};
  switches_.erase(first);
  return due;
}

bool Timeline::awaits_origin(const RunClock& clock) const {
  return std::ranges::any_of(switches_,
                             [&](const FaultSwitch& each) { return !clock.at_ns(each.when).has_value(); });
}

std::optional<Hold> Timeline::take_hold(const RunClock& clock, uint64_t now_ns) {
  const auto due = std::ranges::find_if(holds_, [&](const PlannedHold& planned) {
    const auto due_ns = clock.at_ns(planned.when);
    return due_ns && *due_ns <= now_ns;
  });
  if (due == holds_.end()) return std::nullopt;
  Hold hold = std::move(due->hold);
  holds_.erase(due);
  return hold;
}

}  // namespace diastole::sim_rig
