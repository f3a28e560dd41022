#pragma once
// Motions of the image cut off by an e-stop or a limit switch at random moments, the serial line flooded: what was
// still made after the input had changed.

#include <cstdint>

namespace diastole::step_path_test {

struct CutFigures {
  int cuts = 0;             ///< trials in which the motor was under way
  uint64_t worst_ns = 0;    ///< from the input's change to the last rising edge of STEP
  uint64_t steps_over = 0;  ///< rising edges after the change, in all
  int most_steps_over = 0;  ///< … in one trial
  uint64_t shortest_pulse_ns = UINT64_MAX;
};

/// Every waveform, every input, peak rates from 1,000 to 30,000 steps/s and 200,000. Records a test failure when a
/// trial does not end in the fault that belongs to it.
CutFigures cut_at_random(int trials, uint32_t seed);

}  // namespace diastole::step_path_test
