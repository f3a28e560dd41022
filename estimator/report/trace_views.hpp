#pragma once
// A trace of an explanation seen cycle by cycle and by frequency.

#include <vector>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::report {

/// Samples [first, last) of one cycle.
struct TraceCycle {
  size_t first = 0;
  size_t last = 0;
  double start_s = 0.0;
  double period_s = 0.0;
};

/// From trigger to trigger; the last is as long as the one before it or ends with the trace. Without triggers the whole
/// trace is one.
std::vector<TraceCycle> cycles_of(const explain::Trace& trace);

/// Root mean square of measured - model over the noise; NaN if nothing was measured.
double misfit_in_noise(const explain::Trace& trace, const std::vector<double>& model);

/// Mean of measured - model over the noise, one row a cycle, one column a part of the cycle; NaN where nothing is.
std::vector<std::vector<double>> residual_grid(const explain::Trace& trace, const std::vector<double>& model,
                                               size_t phases);

/// Successive cycles alike in period (2 %) and size (10 %), averaged by phase.
struct MeanCycle {
  size_t cycles = 0;
  double start_s = 0.0;                                            ///< of the first
  std::vector<double> time_s, measured, before, after, cavity_mL;  ///< cavity_mL empty if the trace has none
};
/// Of all such groups that in which the base model is farthest off.
MeanCycle worst_mean_cycle(const explain::Trace& trace, size_t phases);

/// Amplitude density, unit / sqrt(Hz) against Hz, by Welch's method with Hann windows.
struct Spectrum {
  std::vector<double> frequency_Hz, density;
};
Spectrum residual_spectrum(const explain::Trace& trace, const std::vector<double>& model);
/// What two successive equal cycles differ by, over sqrt(2): noise as it is, without any model. Empty if no two
/// cycles are equal.
Spectrum repeat_spectrum(const explain::Trace& trace);

}  // namespace diastole::report
