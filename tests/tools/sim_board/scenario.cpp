#include "tests/tools/sim_board/scenario.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>

namespace diastole::sim_board_test {
namespace {

using sim_controller::Pin;
using sim_controller::PinEdge;

constexpr uint64_t ms = 1'000'000, s = 1'000 * ms;  // ns
constexpr uint64_t rest_ns = 50 * ms;               // longer than any interval of a motion

bool is_motion(const PinEdge& edge) { return edge.pin == Pin::step || edge.pin == Pin::ttl; }
bool begins(const PinEdge& edge) { return is_motion(edge) && edge.value != 0; }

/// When the motion began and, if `staged`, began again after each rest.
std::vector<uint64_t> beginnings(const std::vector<PinEdge>& edges, bool staged) {
  std::vector<uint64_t> found;
  uint64_t last_ns = 0;
  for (const PinEdge& edge : edges) {
    if (!is_motion(edge)) continue;
    if (begins(edge) && (found.empty() || (staged && edge.time_ns > last_ns + rest_ns)))
      found.push_back(edge.time_ns);
    last_ns = edge.time_ns;
  }
  return found;
}

/// Edges in ticks from the beginning that they belong to; DIR changes just before it.
Motion timed(const std::vector<PinEdge>& edges, bool staged) {
  constexpr uint64_t set_up_ns = 10'000;
  Motion motion;
  const std::vector<uint64_t> origins = beginnings(edges, staged);
  if (origins.empty()) return motion;
  for (const PinEdge& edge : edges) {
    const auto next = std::upper_bound(origins.begin(), origins.end(), edge.time_ns + set_up_ns);
    const uint64_t origin_ns = next == origins.begin() ? *next : *(next - 1);
    const double since_ns = static_cast<double>(edge.time_ns) - static_cast<double>(origin_ns);
    const bool is_switch = edge.pin == Pin::enable || edge.pin == Pin::fault;
    auto& list = edge.pin == Pin::rwave_uV ? motion.wave : is_switch ? motion.switches : motion.edges;
    list.push_back({std::llround(since_ns * 0.084), edge.pin, edge.value});
  }
  if (!staged)
    std::ranges::stable_sort(motion.edges, {}, [](const TimedEdge& e) { return std::pair(e.tick, e.pin); });
  return motion;
}

class Holder {
 public:
  Holder(const Scenario& scenario, ScenarioRig& rig)
      : scenario_(scenario), rig_(rig), host_(rig.controller()) {}

  Session hold() {
    Session session;
    host_.prepare();
    scenario_.before(host_);
    for (const wire::AddSegment& segment : scenario_.program)
      host_.ask(segment);
    if (scenario_.motion) {
      session.motion = watch([this] { scenario_.motion(host_); }, true);
    } else {
      session.motion = watch([this] { run(scenario_.act); }, false);
    }
    if (scenario_.act == Act::none && !scenario_.motion) return session;
    make_ready();
    session.again = watch([this] { run(Act::none); }, false);
    return session;
  }

 private:
  template <class Moving>
  Motion watch(Moving moving, bool staged) {
    host_.edges.clear();
    host_.ended.reset();
    moving();
    Motion motion = timed(host_.edges, staged);
    motion.end_microsteps = rig_.position_microsteps();
    motion.fault = host_.fault;
    if (host_.ended) motion.reason = host_.ended->reason;
    return motion;
  }

  void run(Act act) {
    wire::Arm arm = wire::Arm::example();
    arm.gate_every = scenario_.gate_every;
    arm.trigger_delay_us = scenario_.trigger_delay_us;
    arm.rest_us = 100'000;
    wire::Start start{};
    start.lease_id = MiniatureHost::lease;
    if (!host_.ask(arm) || !host_.ask(start)) return;
    const auto moved = [this] { return std::ranges::any_of(host_.edges, begins); };
    if (act != Act::none && host_.run_until(moved, s)) {
      const uint64_t origin_ns = std::ranges::find_if(host_.edges, begins)->time_ns;
      disturb(act, origin_ns + scenario_.act_after_ms * ms);
    }
    host_.run_until([this] { return host_.ended.has_value(); }, 60 * s);
    host_.run_for(100 * ms);
  }

  void disturb(Act act, uint64_t time_ns) {
    if (act == Act::estop) return rig_.set_estop(time_ns, true);
    if (act == Act::far_limit) return rig_.set_far_limit(time_ns, true);
    if (act == Act::silence) host_.last_heartbeat_ns = time_ns;
    host_.run_until([&] { return host_.now_ns() >= time_ns; }, 60 * s);
    if (act == Act::stop_at_cycle_end) (void)host_.ask(wire::StopAtCycleEnd{});
    if (act == Act::stop_now) (void)host_.ask(wire::StopNow{});
    if (act == Act::halt) (void)host_.ask(wire::Halt{});
  }

  /// Switches released, fault cleared, homed.
  void make_ready() {
    const uint64_t soon_ns = host_.now_ns() + ms;
    rig_.set_estop(soon_ns, false);
    rig_.set_far_limit(soon_ns, false);
    host_.last_heartbeat_ns.reset();
    host_.run_for(200 * ms);
    if (host_.state == wire::State::faulted) (void)host_.ask(wire::ClearFault{});
    host_.fault = wire::Fault::none;
    wire::Home home{};
    home.lease_id = MiniatureHost::lease;
    (void)host_.ask(home);
    host_.run_until([this] { return host_.state == wire::State::homed; }, 60 * s);
    host_.run_for(50 * ms);
  }

  const Scenario& scenario_;
  ScenarioRig& rig_;
  MiniatureHost host_;
};

}  // namespace

std::ostream& operator<<(std::ostream& out, const Scenario& scenario) { return out << scenario.name; }

std::ostream& operator<<(std::ostream& out, const TimedEdge& edge) {
  return out << edge.tick << ' ' << sim_controller::pin_name(edge.pin) << ' ' << edge.value;
}

Session hold(const Scenario& scenario, ScenarioRig& rig) { return Holder(scenario, rig).hold(); }

}  // namespace diastole::sim_board_test
