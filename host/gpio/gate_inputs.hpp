#pragma once
// What the host's own digital inputs see of the rig, apart from what the controller says: the gating line (the TTL
// that the scanner gets) and the emergency stop. Times are the kernel's, on the clock of RealClock.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace diastole {

struct GpioConfig {
  std::string chip;  ///< "gpiochip0", its label or its path
  std::optional<unsigned> gate_line{};
  std::optional<unsigned> estop_line{};
  bool gate_active_low = false;
  bool estop_active_low = false;
};

struct EstopChange {
  uint64_t host_ns = 0;
  bool pressed = false;
  bool edge_seen = true;  ///< false: only the level shows it; the edge was lost
};

/// Since the last one was taken, however long ago: a noisy line at rest fills no memory.
struct GateReading {
  static constexpr size_t most_kept = 4096;

  uint64_t pulses = 0;                     ///< rising edges of the gating line
  std::vector<uint64_t> pulse_ns;          ///< when the first `most_kept` of them came, in order
  bool may_have_lost = false;              ///< the kernel's buffer was found full: more pulses may have come
  uint64_t estop_edges = 0;                ///< changes of the emergency stop line
  std::vector<EstopChange> estop_changes;  ///< the first most_kept - 1 of them and the last
  std::string problem;                     ///< the lines can no longer be read

  void note_pulse(uint64_t host_ns) {
    ++pulses;
    if (pulse_ns.size() < most_kept) pulse_ns.push_back(host_ns);
  }
  void note_estop(const EstopChange& change) {
    ++estop_edges;
    if (estop_changes.size() == most_kept) estop_changes.pop_back();
    estop_changes.push_back(change);
  }
};

class GateInputs {
 public:
  virtual ~GateInputs() = default;
  [[nodiscard]] virtual std::string describe() const = 0;
  [[nodiscard]] virtual bool counts_pulses() const = 0;
  [[nodiscard]] virtual bool sees_estop() const = 0;
  /// Never waits.
  virtual GateReading take() = 0;
  /// The emergency stop's present level; false without that line.
  [[nodiscard]] virtual bool estop_pressed() const = 0;
};

/// Through libgpiod. A thread of its own reads the edges as they come, as the kernel keeps no more than 16 a line and
/// drops what follows without a sign, and looks at the emergency stop's level 50 times a second. Of a line that fills the kernel's
/// buffer it reads 16,000 edges a second at most, so that a loose wire costs no processor. Throws
/// HardwareError when chip or line is absent, forbidden or in use.
std::unique_ptr<GateInputs> open_gpio(const GpioConfig& config);

}  // namespace diastole
