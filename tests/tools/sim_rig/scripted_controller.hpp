#pragma once
// A controller for tests: plays given pin changes, echoes every byte it receives with its time.

#include <deque>
#include <set>
#include <vector>

#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole::sim_rig {

class ScriptedController final : public sim_controller::SimulatedController {
 public:
  explicit ScriptedController(std::vector<sim_controller::PinEdge> script)
      : script_(script.begin(), script.end()) {}

  [[nodiscard]] Places places() const override { return {.parked = 200, .home = 65}; }
  void receive(std::span<const uint8_t> bytes) override {
    received_.insert(received_.end(), bytes.begin(), bytes.end());
  }
  void hold_switch(sim_controller::Switch which, bool active) override {
    active ? void(held.insert(which)) : void(held.erase(which));
  }
  void set_power(bool on) override { powered = on; }
  Output advance_to(uint64_t until_ns) override {
    edges_.clear();
    while (!script_.empty() && script_.front().time_ns <= until_ns) {
      edges_.push_back(script_.front());
      script_.pop_front();
    }
    sent_ = std::exchange(received_, {});
    return {sent_, edges_};
  }

  std::set<sim_controller::Switch> held;
  bool powered = true;

 private:
  std::deque<sim_controller::PinEdge> script_;
  std::vector<sim_controller::PinEdge> edges_;
  std::vector<uint8_t> received_;
  std::vector<uint8_t> sent_;
};

/// Steps out of the parked position onto the home switch and off it again, then `microsteps` into the line;
/// one step every `spacing_ns`.
inline std::vector<sim_controller::PinEdge> home_and_inflate(int microsteps, uint64_t spacing_ns) {
  std::vector<sim_controller::PinEdge> script;
  uint64_t time_ns = spacing_ns;
  const auto steps = [&](int direction, int count) {
    script.push_back({time_ns, sim_controller::Pin::dir, direction});
    for (int i = 0; i < count; ++i, time_ns += spacing_ns) {
      script.push_back({time_ns, sim_controller::Pin::step, 1});
      script.push_back({time_ns + spacing_ns / 4, sim_controller::Pin::step, 0});
    }
  };
  steps(0, 200);
  steps(1, 65 + microsteps);
  return script;
}

}  // namespace diastole::sim_rig
