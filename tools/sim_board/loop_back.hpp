#pragma once
// The wires of a self-test on the emulated board (docs/on-the-chip.md): STEP to PA3, TTL to PA5, the R-wave to PC3; and what
// may be wrong with them.

#include <cstdint>

#include "tools/sim_board/emulated_controller.hpp"

namespace diastole {

struct LoopBack {
  bool step = true, ttl = true, r_wave = true;  ///< whether the wire is there
  uint64_t lost_step = 0;  ///< this rise of STEP does not arrive, counted from 1; 0: all do
  uint64_t step_delay_ns = 0, ttl_delay_ns = 0;
  uint64_t step_jitter_ns = 0, ttl_jitter_ns = 0;  ///< by which every other pulse comes later still
  bool ttl_bounces = false;                        ///< each pulse comes as two
  double r_wave_gain = 1;                          ///< of the output as it arrives
  double r_wave_offset_V = 0;
  uint64_t r_wave_delay_ns = 0;
};

/// Puts the wires on; there is no taking them off. `board` outlives its own calls of this.
void connect_loop_back(SimBoard& board, const LoopBack& wires);

}  // namespace diastole
