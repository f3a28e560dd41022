#pragma once
// Measurements that the model itself predicts, with seeded normal noise: what the fit must give back.

#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/io/measurement.hpp"

namespace diastole::test {

struct SyntheticOptions {
  std::vector<double> pressures_kPa = {1.5, 3.0};
  size_t tags_a_frame = 150;
  size_t points_a_frame = 0;
  double sigma_mm = 0.3;    ///< stated
  double sigma_kPa = 0.02;  ///< stated
  double noise = 1.0;       ///< factor on both; 0 for exact data
  unsigned seed = 1;
};

/// The gel phantom on 4 x 2 x 1 elements: quick, and as good as any for statements about the fit itself.
ElasticModel coarse_gel(double C1_kPa);

/// Frame 0 (with as many points) and one frame a pressure.
Measurement synthetic(ElasticModel& truth, const SyntheticOptions& options);

/// The fit of one whole C1 on the coarse gel.
FitOutcome fit_C1(const Measurement& measurement, EstimatedParameter estimated = {6.0, 1.0, 15.0});

}  // namespace diastole::test
