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
      Listeners listeners)
      : description_(description),
        controller_(std::move(controller)),
        listeners_(std::move(listeners)),
        carriage_(description.microstep_mL, controller_->places()),
        plant_(description.plant) {}

  void receive(std::span<const uint8_t> bytes) { controller_->receive(bytes); }

  /// Carries controller and plant to until_ns. No effect if that is past.
  void advance_to(uint64_t until_ns) {
    if (until_ns <= now_ns_) return;
    now_ns_ = until_ns;
    const sim_controller::SimulatedController::Output output = controller_->advance_to(now_ns_);
    for (const sim_controller::PinEdge& edge : output.edges) {
      plant_.advance_to(seconds(edge.time_ns));  // the load under which this step is made
      if (const auto displaced_mL = carriage_.take(edge, plant_.pump_end_kPa())) {
        plant_.displace(seconds(edge.time_ns), *displaced_mL);
      }
      if (edge.pin == sim_controller::Pin::ttl && edge.value != 0) plant_.begin_cycle();
      listeners_.edge(edge);
    }
    if (!output.sent.empty()) listeners_.sent(output.sent);
    plant_.advance_to(seconds(now_ns_));
  }

  [[nodiscard]] uint64_t now_ns() const { return now_ns_; }
  /// What the instrument measures at one of its inputs now; 0 V where nothing is connected.
  [[nodiscard]] double volts(int64_t input) const {
    for (const DaqChannel& channel : description_.channels) {
      if (channel.input != input || channel.place == DaqChannel::Place::none) continue;
      const double pressure_kPa = channel.place == DaqChannel::Place::cavity ? plant_.cavity_reading_kPa()
                                                                             : plant_.pump_reading_kPa();
      return channel.zero_V + pressure_kPa / channel.kPa_per_V;
    }
    return 0;
  }
  [[nodiscard]] const Plant& plant() const { return plant_; }

  // What can be made to go wrong from now on.
  [[nodiscard]] sim_controller::SimulatedController& controller() { return *controller_; }
  [[nodiscard]] Carriage& carriage() { return carriage_; }
  [[nodiscard]] Plant& plant() { return plant_; }

 private:
  static constexpr double seconds(uint64_t time_ns) { return static_cast<double>(time_ns) * 1e-9; }

  RigDescription description_;
  std::unique_ptr<sim_controller::SimulatedController> controller_;
  Listeners listeners_;
  Carriage carriage_;
  Plant plant_;
  uint64_t now_ns_ = 0;
};

}  // namespace diastole::sim_rig
