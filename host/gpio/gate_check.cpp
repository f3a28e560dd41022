#include "host/gpio/gate_check.hpp"

#include <fmt/format.h>

namespace diastole {
namespace {

constexpr uint64_t report_patience_ns = 500'000'000;  // for the controller's report of a trigger or a fault

}  // namespace

GateCheck::GateCheck(GateInputs& inputs) : inputs_(inputs) {
  (void)inputs_.take();
  if (inputs_.estop_pressed()) estop_since_ns_ = 0;
}

void GateCheck::take(std::vector<GateRemark>& out, uint64_t now_ns) {
  const GateReading reading = inputs_.take();
  pulses_ += reading.pulses;
  may_have_lost_ = may_have_lost_ || reading.may_have_lost;
  for (const EstopChange& change : reading.estop_changes) {
    if (change.pressed) {  // also one that is released again is to be reported
      estop_since_ns_ = change.host_ns;
      estop_reported_ = false;
    }
    out.push_back({"warning", "estop_line",
                   fmt::format("the emergency stop line shows: {}{}", change.pressed ? "pressed" : "released",
                               change.edge_seen ? "" : " (by its level; the edge itself was not seen)"),
                   change.host_ns});
  }
  if (!reading.problem.empty() && !failed_) {
    failed_ = true;
    out.push_back({"error", "gpio",
                   fmt::format("{} can no longer be read: {}", inputs_.describe(), reading.problem), now_ns});
  }
}

std::vector<GateRemark> GateCheck::check(uint64_t now_ns, const ControllerWitness& controller) {
  std::vector<GateRemark> out;
  take(out, now_ns);
  if (inputs_.counts_pulses() && pulses_ != controller.triggers) {
    if (!counts_differ_since_ns_) counts_differ_since_ns_ = now_ns;
    if (!counts_reported_ && now_ns - *counts_differ_since_ns_ > report_patience_ns) {
      counts_reported_ = true;
      out.push_back({"error", "gate_count",
                     fmt::format("the gating line showed {} pulses, the controller reported {} triggers",
                                 pulses_, controller.triggers),
                     now_ns});
    }
  } else {
    counts_differ_since_ns_.reset();
  }
  if (estop_since_ns_ && !controller.stopped_by_estop && !estop_reported_ &&
      !awaits_estop(now_ns, controller)) {
    estop_reported_ = true;
    out.push_back({"error", "estop_unseen",
                   "the emergency stop line showed pressed, but the controller reports no emergency stop",
                   now_ns});
  }
  return out;
}

bool GateCheck::awaits_estop(uint64_t now_ns, const ControllerWitness& controller) const {
  return estop_since_ns_ && !controller.stopped_by_estop && now_ns <= *estop_since_ns_ + report_patience_ns;
}

std::vector<GateRemark> GateCheck::close(uint64_t now_ns, const ControllerWitness& controller,
                                         std::optional<uint64_t> triggers_raised) {
  std::vector<GateRemark> out;
  take(out, now_ns);
  if (!inputs_.counts_pulses()) return out;
  const uint64_t raised = triggers_raised.value_or(controller.triggers);
  if (pulses_ == raised) {
    out.push_back({"info", "gate_count",
                   fmt::format("{} pulses on the gating line, as the controller counted", pulses_), now_ns});
    return out;
  }
  out.push_back({"error", "gate_count",
                 fmt::format("the gating line showed {} pulses, the controller raised {} triggers{}", pulses_,
                             raised, may_have_lost_ ? " (edges came faster than they could be read)" : ""),
                 now_ns});
  return out;
}

}  // namespace diastole
