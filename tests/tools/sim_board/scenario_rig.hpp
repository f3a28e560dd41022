#pragma once
// The two places where the firmware runs, with switches that can be moved at a given time: built for this machine
// on the recording board, and as its image on the emulated one.

#include <cstdint>
#include <memory>
#include <string>

#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole::sim_board_test {

class ScenarioRig {
 public:
  virtual ~ScenarioRig() = default;
  [[nodiscard]] virtual sim_controller::SimulatedController& controller() = 0;
  /// From time_ns on, which lies ahead.
  virtual void set_estop(uint64_t time_ns, bool pressed) = 0;
  virtual void set_far_limit(uint64_t time_ns, bool closed) = 0;
  /// Where the motor is, from the home switch.
  [[nodiscard]] virtual int64_t position_microsteps() const = 0;
};

std::unique_ptr<ScenarioRig> recorded_rig();
/// `image`: the firmware's ELF file.
std::unique_ptr<ScenarioRig> emulated_rig(const std::string& image);

}  // namespace diastole::sim_board_test
