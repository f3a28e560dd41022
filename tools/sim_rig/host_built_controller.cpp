#include "tools/sim_rig/host_built_controller.hpp"

#include <array>
#include <optional>
#include <vector>

#include "firmware/boards/recording/recorded_controller.hpp"
#include "firmware/core/homing.hpp"

namespace diastole::sim_rig {
namespace {

constexpr firmware::Ticks ticks_at(uint64_t time_ns) {
  const auto whole_us = static_cast<int64_t>(time_ns / 1000);
  const auto rest_ns = static_cast<int64_t>(time_ns % 1000);
  return firmware::Ticks{whole_us * firmware::kTicksPerMicrosecond +
                         rest_ns * firmware::kTicksPerMicrosecond / 1000};
}

/// Both count the pins in the same order.
sim_controller::Pin pin_of(firmware::Signal signal) { return static_cast<sim_controller::Pin>(signal); }
static_assert(static_cast<int>(firmware::Signal::FAULT) == static_cast<int>(sim_controller::Pin::fault));

class HostBuiltController final : public sim_controller::SimulatedController {
 public:
  [[nodiscard]] Places places() const override {
    return {options_.board.mechanics.start_steps, 1 + int64_t{firmware::kHomeClearance_steps}};
  }

  [[nodiscard]] uint64_t tick_zero_ns() const override { return powered_ns_; }

  void receive(std::span<const uint8_t> bytes) override {
    if (controller_) controller_->feed(bytes);
  }

  Output advance_to(uint64_t until_ns) override {
    now_ns_ = until_ns;
    sent_.clear();
    edges_.swap(fallen_);
    fallen_.clear();
    if (!controller_) return {sent_, edges_};
    controller_->advance_to(ticks_at(until_ns - powered_ns_));
    sent_ = controller_->take_output();
    for (const firmware::Edge& edge : controller_->take_edges()) {
      note({powered_ns_ + static_cast<uint64_t>(firmware::nanoseconds(edge.tick)), pin_of(edge.signal),
            edge.value},
           edges_);
    }
    return {sent_, edges_};
  }

  void hold_switch(sim_controller::Switch which, bool active) override {
    held_[static_cast<size_t>(which)] = active;
    apply_switches();
  }

  void set_power(bool on) override {
    if (on == controller_.has_value()) return;
    if (!on) return cut_power();
    powered_ns_ = now_ns_;
    ++options_.board.identity.boot_id;
    controller_.emplace(options_);
    apply_switches();
  }

 private:
  void note(const sim_controller::PinEdge& edge, std::vector<sim_controller::PinEdge>& edges) {
    levels_[static_cast<size_t>(edge.pin)] = edge.value;
    edges.push_back(edge);
  }

  void apply_switches() {
    if (!controller_) return;
    controller_->set_estop(held_[static_cast<size_t>(sim_controller::Switch::estop)]);
    controller_->set_home(held_[static_cast<size_t>(sim_controller::Switch::home)]);
    controller_->set_far_limit(held_[static_cast<size_t>(sim_controller::Switch::far_limit)]);
  }

  /// The pins fall, the carriage stays, what was in RAM is gone.
  void cut_power() {
    options_.board.mechanics.start_steps = controller_->mechanical_microsteps();
    options_.board.memory->retained = {};
    controller_.reset();
    for (size_t pin = 0; pin < levels_.size(); ++pin) {
      if (levels_[pin] != 0) note({now_ns_, static_cast<sim_controller::Pin>(pin), 0}, fallen_);
    }
  }

  firmware::RecordedController::Options options_;
  std::optional<firmware::RecordedController> controller_{std::in_place, options_};
  uint64_t now_ns_ = 0;
  uint64_t powered_ns_ = 0;  ///< since when
  std::array<bool, 3> held_{};
  std::array<int32_t, 6> levels_{};
  std::vector<sim_controller::PinEdge> fallen_;  ///< when power was cut
  std::vector<uint8_t> sent_;
  std::vector<sim_controller::PinEdge> edges_;
};

}  // namespace

std::unique_ptr<sim_controller::SimulatedController> make_host_built_controller() {
  return std::make_unique<HostBuiltController>();
}

}  // namespace diastole::sim_rig
