#pragma once
// Where a pressure signal steps from one quiet level to another.

#include <span>
#include <string>
#include <vector>

namespace diastole::signal {

struct FoundStep {
  size_t onset = 0;  ///< the first sample that has left the level before
  size_t first = 0;  ///< samples [first, last) belong to it: 0.1 s before to 0.6 s after, or to the next step
  size_t last = 0;
  double before_kPa = 0;
  double after_kPa = 0;
  double noise_kPa = 0;  ///< standard deviation of the level before
};

struct StepSearch {
  std::vector<FoundStep> steps;
  std::string nearest;  ///< what came nearest to a step when there is none, in words
};

/// A step: the means over 0.1 s before it and from 0.3 to 0.4 s after it differ by more than ten times either's
/// standard deviation, and half the difference is there within 60 ms. Missing samples (NaN) make none.
StepSearch find_steps(std::span<const double> pressure_kPa, double spacing_s);

}  // namespace diastole::signal
