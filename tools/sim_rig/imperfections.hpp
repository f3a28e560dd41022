#pragma once
// How a rig departs from its description without anything being wrong with it: each part is off by what such parts
// are off by. A seed is a rig: all of its sessions have the same imperfections.

#include <cstdint>

#include "tools/sim_rig/plant/plant.hpp"

namespace diastole::sim_rig {

/// Draws them for rig number `seed` (0: the plant stays as it is described). Normal deviates with the sds that
/// imperfections.cpp lists. Effects are to be hidden afterwards.
void draw_imperfections(uint64_t seed, PlantConfig& plant);

}  // namespace diastole::sim_rig
