#pragma once
// Whole turns of a velocity that exceeds the venc, from its course over the cycle.

#include <vector>

namespace diastole::imaging {

struct UnwrappedCycle {
  std::vector<double> phase_rad;  ///< with whole turns put back
  std::vector<int> turns;         ///< that were
  double largest_step_rad = 0;    ///< from one phase to the next; near half a turn the turns are a guess
};

/// Of the ways to add whole turns the one whose steps from phase to phase have the least sum of squares; where the cycle closes, its last step too.
/// The whole course is then shifted by the turns that bring its mean nearest to zero. `gap`: number of usual steps from each phase to the next, the last to the first's return.
UnwrappedCycle unwrapped(const std::vector<double>& phase_rad, const std::vector<double>& gap);

}  // namespace diastole::imaging
