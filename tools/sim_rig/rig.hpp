#pragma once
// The whole rig on one clock: controller, carriage, plant, and the volts at the instrument's inputs.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "tools/sim_controller/simulated_controller.hpp"
#include "tools/sim_rig/carriage.hpp"
#include "tools/sim_rig/plant/plant.hpp"
#include "tools/sim_rig/rig_description.hpp"

namespace diastole::sim_rig {

class Rig {
 public:
  /// Who hears what the controller does, while time advances.
  struct Listeners {
    std::function<void(std::span<const uint8_t>)> sent;
    std::function<void(const sim_controller::PinEdge&)> edge;
  };

  Rig(const RigDescription& description, std::unique_ptr<sim_controller::SimulatedController> controller,
      Listeners listeners);

  void receive(std::span<const uint8_t> bytes) { controller_->receive(bytes); }

  /// Carries controller and plant to until_ns. No effect if that is past.
  void advance_to(uint64_t until_ns);

  [[nodiscard]] uint64_t now_ns() const { return now_ns_; }
  /// What the instrument measures at one of its inputs now; 0 V where nothing is connected.
  [[nodiscard]] double volts(int64_t input) const;
  [[nodiscard]] const Plant& plant() const { return plant_; }

  // What can be made to go wrong from now on.
  [[nodiscard]] sim_controller::SimulatedController& controller() { return *controller_; }
  [[nodiscard]] Carriage& carriage() { return carriage_; }
  [[nodiscard]] Plant& plant() { return plant_; }

 private:
  RigDescription description_;
  std::unique_ptr<sim_controller::SimulatedController> controller_;
  Listeners listeners_;
  Carriage carriage_;
  Plant plant_;
  uint64_t now_ns_ = 0;
};

}  // namespace diastole::sim_rig
