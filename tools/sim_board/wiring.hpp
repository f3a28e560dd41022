#pragma once
// Which wire of the rig is on which pin of the board, and in which sense (the wiring page of the firmware).

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "tools/sim_board/core/pins.hpp"
#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole {

/// A wire: its pin, and the level that means "active" (STEP high, motor enabled, switch closed ...).
struct Wire {
  board_model::Pin pin;
  bool active_high = true;
};

struct Wiring {
  Wire step, dir, enable, ttl, fault;  ///< outputs; DIR active is "inflate"
  Wire estop, home, far_limit;         ///< inputs; active is "pressed", "closed"
  uint8_t rwave_dac = 1;               ///< DAC channel
  uint32_t fault_number = 0;           ///< address of the byte that holds the number behind the FAULT pin
};

/// The board as firmware/boards/stm32f405/pins.hpp draws it.
const Wiring& diastole_wiring();

/// The event in the terms of a pin trace; nullopt for a pin that is not in it.
std::optional<sim_controller::PinEdge> pin_edge(const Wiring& wiring, const board_model::PinEvent& event);

}  // namespace diastole
