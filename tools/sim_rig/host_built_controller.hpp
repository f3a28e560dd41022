#pragma once
// The firmware's core built for this machine, on the recording board.

#include <memory>

#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole::sim_rig {

std::unique_ptr<sim_controller::SimulatedController> make_host_built_controller();

}  // namespace diastole::sim_rig
