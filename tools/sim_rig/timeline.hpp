#pragma once
// What is planned to happen to the rig: faults that are switched, and moments at which a client of the control socket
// wants time to stand still. Moments after the first trigger or the start of run become known on the way.

#include <optional>
#include <string>
#include <vector>

#include "tools/sim_rig/control_server.hpp"
#include "tools/sim_rig/faults/fault_schedule.hpp"
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
  std::optional<Due> take_switch(const RunClock& clock, uint64_t until_ns);
  /// Whether a switch counts from something that has not happened yet.
  [[nodiscard]] bool awaits_origin(const RunClock& clock) const;
  /// A hold that is due at `now_ns`; it is planned no more.
  std::optional<Hold> take_hold(const RunClock& clock, uint64_t now_ns);

 private:
  struct PlannedHold {
    Hold hold;
    Moment when;
  };
  std::vector<FaultSwitch> switches_;
  std::vector<PlannedHold> holds_;
};

}  // namespace diastole::sim_rig
