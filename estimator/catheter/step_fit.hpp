#pragma once
// The catheter's frequency response from recorded steps of pressure (a pop test: a balloon or membrane over the
// catheter's tip bursts).
//
// A step is a change between two quiet levels, most of it within 60 ms. Each is fitted by least squares with
//   p(t) = p0 + dp s(t - t0; f0, zeta)      (protocol/signal/step_response.hpp)
// over its surroundings. The noise of a transducer is correlated, so the covariance is
//   (J'J)^-1 J' G J (J'J)^-1,   G_ij = g_|i-j|,
// with the autocovariance g of what the fit leaves (tapered to nothing over 20 samples). Several steps are averaged by
// their weights in ln f0 and ln zeta; where they scatter more than their errors say, the errors grow accordingly.

#include <array>
#include <span>
#include <string>
#include <vector>

#include "protocol/signal/step_response.hpp"

namespace diastole::signal {

struct Estimate {
  double value = 0;
  double se = 0;
  std::array<double, 2> ci95{};
};

struct FittedStep {
  double time_s = 0;      ///< t0
  double before_kPa = 0;  ///< p0
  double jump_kPa = 0;    ///< dp
  Estimate f0_Hz;
  Estimate zeta;
  double rms_kPa = 0;    ///< what the fit leaves
  double noise_kPa = 0;  ///< standard deviation of the level before
  size_t first = 0;      ///< samples [first, last) were fitted
  size_t last = 0;
  /// Of (ln f0, ln zeta), row by row.
  std::array<double, 4> log_covariance{};
};

struct CatheterResponse {
  Estimate f0_Hz;
  Estimate zeta;
  Estimate minus_3dB_Hz;
  Estimate lag_limit_Hz;   ///< lag 5 % of the period
  Estimate flat_limit_Hz;  ///< amplitude 5 % off
  Estimate delay_s;        ///< of slow signals
  std::vector<FittedStep> steps;
  std::vector<std::string> remarks;  ///< steps left out and why, what does not fit, in words
  std::string refusal;               ///< why there is no answer; empty if there is one: then all else holds
};

/// Samples `time_s` apart evenly but for jitter; NaN: missing.
CatheterResponse fit_catheter(std::span<const double> time_s, std::span<const double> pressure_kPa);

}  // namespace diastole::signal
