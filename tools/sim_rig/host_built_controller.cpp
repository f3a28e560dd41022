#include "tools/sim_rig/host_built_controller.hpp"

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

Pin pin_of(firmware::Signal signal) {
  switch (signal) {
    case firmware::Signal::STEP:
      return Pin::step;
    case firmware::Signal::DIR:
      return Pin::dir;
    case firmware::Signal::ENABLE:
      return Pin::enable;
    case firmware::Signal::TTL:
      return Pin::ttl;
    case firmware::Signal::RWAVE_uV:
      return Pin::rwave_uV;
    case firmware::Signal::FAULT:
      return Pin::fault;
  }
  return Pin::fault;
}

class HostBuiltController final : public SimulatedController {
 public:
  [[nodiscard]] Places places() const override {
    return {controller_.mechanical_microsteps(), 1 + int64_t{firmware::kHomeClearance_steps}};
  }

  void receive(std::span<const uint8_t> bytes) override { controller_.feed(bytes); }

  Output advance_to(uint64_t until_ns) override {
    controller_.advance_to(ticks_at(until_ns));
    sent_ = controller_.take_output();
    edges_.clear();
    for (const firmware::Edge& edge : controller_.take_edges()) {
      edges_.push_back(
          {static_cast<uint64_t>(firmware::nanoseconds(edge.tick)), pin_of(edge.signal), edge.value});
    }
    return {sent_, edges_};
  }

 private:
  firmware::RecordedController controller_;
  std::vector<uint8_t> sent_;
  std::vector<PinEdge> edges_;
};

}  // namespace

std::unique_ptr<SimulatedController> make_host_built_controller() {
  return std::make_unique<HostBuiltController>();
}

}  // namespace diastole::sim_rig
