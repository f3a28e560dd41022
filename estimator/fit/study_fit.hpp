#pragma once
// `diastole fit`: from a study and its measurements to the record that is shown, kept and reported.

#include <functional>

#include "estimator/fit/fit.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

struct StudyFitOptions {
  int iteration_limit = 50;
  std::function<void(const FitIteration&)> on_iteration;
};

/// Throws InputError for studies that cannot be modelled (study_model.hpp) or hold no loaded point.
/// Numerical trouble is told by `converged` and `reason` of the record.
FitRecord fit_study(const Study& study, const Measurement& measurement, const StudyFitOptions& options);

}  // namespace diastole
