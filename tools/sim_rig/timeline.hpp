#pragma once
// What is planned to happen to the rig: faults that are switched, and moments at which a client of the control socket
// wants time to stand still. Moments after the first trigger or the start of run become known on the way.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "tools/sim_rig/control_server.hpp"
#include "tools/sim_rig/fault_schedule.hpp"
#include "tools/sim_rig/run_clock.hpp"

namespace diastole::sim_rig {

struct Hold {
  ControlServer::ClientId client = 0;
  std::string moment;  ///< as the client put it
};

class Timeline {
 public:
  void plan(const std::vector<FaultSwitch>& switches) {
    switches_.insert(switches_.end(), switches.begin(), switches.end());
  }
  void plan(const Hold& hold, const Moment& when) { holds_.push_back({hold, when}); }

  /// The first switch that is due at or before `until_ns`, with its time; of equal ones that which was planned first.
  /// It is planned no more.
  struct Due {
    uint64_t time_ns;
    FaultSwitch what;
  };
  std::optional<Due> take_switch(const RunClock& clock, uint64_t until_ns) {
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
  /// Whether a switch counts from something that has not happened yet.
  [[nodiscard]] bool awaits_origin(const RunClock& clock) const {
    return std::ranges::any_of(switches_,
                               [&](const FaultSwitch& each) { return !clock.at_ns(each.when).has_value(); });
  }
  /// A hold that is due at `now_ns`; it is planned no more.
  std::optional<Hold> take_hold(const RunClock& clock, uint64_t now_ns) {
    const auto due = std::ranges::find_if(holds_, [&](const PlannedHold& planned) {
      const auto due_ns = clock.at_ns(planned.when);
      return due_ns && *due_ns <= now_ns;
    });
    if (due == holds_.end()) return std::nullopt;
    Hold hold = std::move(due->hold);
    holds_.erase(due);
    return hold;
  }

 private:
  struct PlannedHold {
    Hold hold;
    Moment when;
  };
  std::vector<FaultSwitch> switches_;
  std::vector<PlannedHold> holds_;
};

}  // namespace diastole::sim_rig
