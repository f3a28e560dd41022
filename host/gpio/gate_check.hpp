#pragma once
// Two witnesses of one run: what the host's inputs saw and what the controller reports. Where they disagree, one of
// cable, input, controller or protocol is wrong, and the run says so.
//
//   pulses on the gating line   against   triggers that the controller reported, during the run (a difference that
//                                         lasts longer than a report takes) and against its final count at the end
//   emergency stop pressed      against   the controller's fault, which must follow
//
// A contact that bounces, or a wire that is plugged in nowhere, may show thousands of edges a second. They are counted, and what is
// remarked stays bounded: of the emergency stop line some changes one by one, and how many there were once a second.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/gpio/gate_inputs.hpp"

namespace diastole {

struct GateRemark {
  std::string level;  ///< "info", "warning", "error"
  std::string code;
  std::string text;
  uint64_t host_ns = 0;
};

/// What the controller has reported so far.
struct ControllerWitness {
  uint64_t triggers = 0;
  bool stopped_by_estop = false;
};

class GateCheck {
 public:
  /// From now on; what the inputs saw before is forgotten.
  explicit GateCheck(GateInputs& inputs) : inputs_(inputs) {
    (void)inputs_.take();
    if (inputs_.estop_pressed()) estop_since_ns_ = 0;
  }

  [[nodiscard]] std::vector<GateRemark> check(uint64_t now_ns, const ControllerWitness& controller) {
    std::vector<GateRemark> out;
    take(out, now_ns);
    if (second_since_ns_ == 0) second_since_ns_ = now_ns;
    if (now_ns >= second_since_ns_ + ns_per_s) begin_second(out, now_ns);
    if (inputs_.counts_pulses() && pulses_ != controller.triggers) {
      if (!counts_differ_since_ns_) counts_differ_since_ns_ = now_ns;
      if (!counts_reported_ && now_ns - *counts_differ_since_ns_ > report_timeout_ns) {
        counts_reported_ = true;
        out.push_back({"error", "gate_count",
                       fmt::format("the gating line showed {} pulses, the controller reported {} triggers{}",
                                   pulses_, controller.triggers, bouncing()),
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
  /// Whether the controller still has time to report a pressed emergency stop: the run's end waits for that, half a
  /// second at most.
  [[nodiscard]] bool awaits_estop(uint64_t now_ns, const ControllerWitness& controller) const {
    return estop_since_ns_ && !controller.stopped_by_estop && now_ns <= *estop_since_ns_ + report_timeout_ns;
  }
  /// At the end; `triggers_raised` is the controller's own count, if it reported one.
  [[nodiscard]] std::vector<GateRemark> close(uint64_t now_ns, const ControllerWitness& controller,
                                              std::optional<uint64_t> triggers_raised) {
    std::vector<GateRemark> out;
    take(out, now_ns);
    begin_second(out, now_ns);
    if (!inputs_.counts_pulses()) return out;
    const uint64_t raised = triggers_raised.value_or(controller.triggers);
    if (pulses_ == raised) {
      out.push_back({"info", "gate_count",
                     fmt::format("{} pulses on the gating line, as the controller counted", pulses_),
                     now_ns});
      return out;
    }
    out.push_back({"error", "gate_count",
                   fmt::format("the gating line showed {} pulses, the controller raised {} triggers{}{}",
                               pulses_, raised, bouncing(),
                               may_have_lost_ ? " (edges came faster than they could be read)" : ""),
                   now_ns});
    return out;
  }

  /// Pulses counted on the gating line; none if it is not wired to the host.
  [[nodiscard]] std::optional<uint64_t> pulses() const {
    return inputs_.counts_pulses() ? std::optional(pulses_) : std::nullopt;
  }

 private:
  static constexpr uint64_t report_timeout_ns =
      500'000'000;  // for the controller's report of a trigger or a fault
  static constexpr uint64_t ns_per_s = 1'000'000'000;
  static constexpr uint64_t bounce_ns =
      5'000'000;  // contacts come to rest within milliseconds, no cycle is as short
  static constexpr uint64_t most_changes_a_second = 8;

  [[nodiscard]] std::string bouncing() const {
    return bounces_ == 0 ? ""
                         : fmt::format(" ({} of the pulses within {} ms of the one before: the line bounces)",
                                       bounces_, bounce_ns / 1'000'000);
  }
  /// Says how many changes of the last second were not remarked one by one.
  void begin_second(std::vector<GateRemark>& out, uint64_t now_ns) {
    if (changes_ > most_changes_a_second) {
      out.push_back({"warning", "estop_line",
                     fmt::format("the emergency stop line changed {} times in {:.1f} s and now shows {}: it "
                                 "bounces, or is loose",
                                 changes_, 1e-9 * static_cast<double>(now_ns - second_since_ns_),
                                 inputs_.estop_pressed() ? "pressed" : "released"),
                     now_ns});
    }
    changes_ = 0;
    second_since_ns_ = now_ns;
  }

  void take(std::vector<GateRemark>& out, uint64_t now_ns) {
    const GateReading reading = inputs_.take();
    pulses_ += reading.pulses;
    may_have_lost_ = may_have_lost_ || reading.may_have_lost;
    for (const uint64_t pulse_ns : reading.pulse_ns) {
      bounces_ += last_pulse_ns_ && pulse_ns - *last_pulse_ns_ < bounce_ns ? 1 : 0;
      last_pulse_ns_ = pulse_ns;
    }
    changes_ += reading.estop_edges;
    uint64_t remarked = changes_ - std::min(changes_, reading.estop_edges);
    for (const EstopChange& change : reading.estop_changes) {
      if (change.pressed) {  // also one that is released again is to be reported
        estop_since_ns_ = change.host_ns;
        estop_reported_ = false;
      }
      if (++remarked > most_changes_a_second) continue;
      out.push_back(
          {"warning", "estop_line",
           fmt::format("the emergency stop line shows: {}{}", change.pressed ? "pressed" : "released",
                       change.edge_seen ? "" : " (by its level; the edge itself was not seen)"),
           change.host_ns});
    }
    if (!reading.problem.empty() && !failed_) {
      failed_ = true;
      out.push_back({"error", "gpio",
                     fmt::format("{} can no longer be read: {}", inputs_.describe(), reading.problem),
                     now_ns});
    }
  }

  GateInputs& inputs_;
  uint64_t pulses_ = 0;
  uint64_t bounces_ = 0;  ///< of them, as far as their times were kept
  std::optional<uint64_t> last_pulse_ns_;
  uint64_t changes_ = 0;  ///< of the emergency stop line, since then
  uint64_t second_since_ns_ = 0;
  bool may_have_lost_ = false;
  bool failed_ = false;
  std::optional<uint64_t> counts_differ_since_ns_;
  bool counts_reported_ = false;
  std::optional<uint64_t> estop_since_ns_;  ///< pressed last
  bool estop_reported_ = false;
};

}  // namespace diastole
