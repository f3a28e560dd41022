#pragma once
// What a session's recordings scatter by themselves: the floor against which misfits are measured.
//
// Three parts, all from the data and without the rig's model:
//   - each channel's noise, correlated over some samples: an autoregression (order 6) of the autocovariance at rest and
//     of successive cycles' differences, pooled over the runs. Cycles that differ by far more slow change than the rest
//     shows (a transient, drift) do not count;
//   - the cycles' variation: each cycle's pressures are larger or smaller by a random factor, the same in both
//     channels; its sd from successive cycles' differences, so that slow changes do not count;
//   - the gated volumes' own sigmas.
//
// Whitening makes residuals independent with unit variance: the autoregression's innovations.

#include <Eigen/Dense>
#include <map>
#include <vector>

#include "estimator/model/session.hpp"

namespace diastole::rig {

struct ChannelNoise {
  double sd_kPa = 0.0;                 ///< of a sample
  double innovation_kPa = 0.0;         ///< what is new in each sample
  std::vector<double> autoregression;  ///< y_k = sum a_j y_(k-j) + innovation
  double samples = 0.0;                ///< that it was estimated from
};

struct NoiseModel {
  std::map<Channel, ChannelNoise> channels;
  double cycle_sd = 0.0;  ///< relative
};

/// Precondition: at least one run with more than a second of rest or two equal cycles; else a channel's noise is the
/// scatter of its second differences.
NoiseModel estimate_noise(const Session& session);

/// Sd of the product of the noise with a function of this frequency whose squares sum to one.
double spectral_sd(const ChannelNoise& noise, double frequency_Hz, double rate_Hz);

/// Innovations over their sd; zero where they would need a missing sample or one before the first.
std::vector<double> whitened(const ChannelNoise& noise, const std::vector<double>& values);

/// Rows [first, last) of a run's samples that belong to one cycle.
struct CycleRows {
  size_t first = 0;
  size_t last = 0;
};
std::vector<CycleRows> cycles_of(const SessionRun& run);

}  // namespace diastole::rig
