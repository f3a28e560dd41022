#include "tools/sim_board/emulated_controller.hpp"

#include "firmware/core/r_wave.hpp"

namespace diastole {
namespace {

constexpr board_model::Pin pin(char port, uint8_t number) {
  return {static_cast<uint8_t>(port - 'A'), number};
}

}  // namespace

const Wiring& diastole_wiring() {
  static constexpr Wiring wiring{.step = {pin('A', 6)},
                                 .dir = {pin('A', 2)},
                                 .enable = {pin('B', 0)},
                                 .ttl = {pin('A', 1)},
                                 .fault = {pin('B', 1)},
                                 .estop = {pin('C', 0)},
                                 .home = {pin('C', 1)},
                                 .far_limit = {pin('C', 2)},
                                 .rwave_dac = 1,
                                 .fault_number = 0x2000'0000};
  return wiring;
}

std::optional<sim_controller::PinEdge> pin_edge(const Wiring& wiring, const board_model::PinEvent& event) {
  if (event.dac != 0) {
    if (event.dac != wiring.rwave_dac) return std::nullopt;
    return sim_controller::PinEdge{event.time_ns, sim_controller::Pin::rwave_uV,
                                   static_cast<int32_t>(firmware::r_wave_uV(event.value))};
  }
  struct Named {
    const Wire& wire;
    sim_controller::Pin name;
  };
  const Named outputs[] = {{wiring.step, sim_controller::Pin::step},
                           {wiring.dir, sim_controller::Pin::dir},
                           {wiring.enable, sim_controller::Pin::enable},
                           {wiring.ttl, sim_controller::Pin::ttl},
                           {wiring.fault, sim_controller::Pin::fault}};
  for (const Named& output : outputs) {
    if (output.wire.pin != event.pin) continue;
    return sim_controller::PinEdge{event.time_ns, output.name,
                                   (event.value != 0) == output.wire.active_high ? 1 : 0};
  }
  return std::nullopt;
}

}  // namespace diastole
