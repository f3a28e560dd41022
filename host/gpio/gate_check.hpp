#pragma once
// Two witnesses of one run: what the host's inputs saw and what the controller reports. Where they disagree, one of
// cable, input, controller or protocol is wrong, and the run says so.
//
//   pulses on the gating line   against   triggers that the controller reported, during the run (a difference that
//                                         lasts longer than a report takes) and against its final count at the end
//   emergency stop pressed      against   the controller's fault, which must follow

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
  explicit GateCheck(GateInputs& inputs);

  [[nodiscard]] std::vector<GateRemark> check(uint64_t now_ns, const ControllerWitness& controller);
  /// Whether the controller still has time to report a pressed emergency stop: the run's end waits for that, half a
  /// second at most.
  [[nodiscard]] bool awaits_estop(uint64_t now_ns, const ControllerWitness& controller) const;
  /// At the end; `triggers_raised` is the controller's own count, if it told.
  [[nodiscard]] std::vector<GateRemark> close(uint64_t now_ns, const ControllerWitness& controller,
                                              std::optional<uint64_t> triggers_raised);

  /// Pulses counted on the gating line; none if it is not wired to the host.
  [[nodiscard]] std::optional<uint64_t> pulses() const {
    return inputs_.counts_pulses() ? std::optional(pulses_) : std::nullopt;
  }

 private:
  void take(std::vector<GateRemark>& out, uint64_t now_ns);

  GateInputs& inputs_;
  uint64_t pulses_ = 0;
  bool may_have_lost_ = false;
  bool failed_ = false;
  std::optional<uint64_t> counts_differ_since_ns_;
  bool counts_reported_ = false;
  std::optional<uint64_t> estop_since_ns_;  ///< pressed last
  bool estop_reported_ = false;
};

}  // namespace diastole
