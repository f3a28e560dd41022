#pragma once
// What a study asks a fit to find.

#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

/// One parameter of the study and its run of values: one for a whole parameter, one an element for a regional one.
struct ParameterRun {
  StudyParameter parameter;
  size_t first;
  size_t count;
  bool is_modulus;  ///< LawParameter's

  [[nodiscard]] double mean(const Eigen::VectorXd& values) const {
    return values.segment(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(count)).mean();
  }
  /// Standard error of the mean, from the covariance of all values.
  [[nodiscard]] double se_of_mean(const Eigen::MatrixXd& covariance) const;
};

/// Parallel vectors in the study's order, an entry a value.
struct EstimatedParameters {
  std::vector<EstimatedParameter> values;
  std::vector<ParameterGroup> groups;  ///< which of the model's parameters each value sets
  std::vector<SmoothRegion> smooth;    ///< the regional parameters that are smooth
  std::vector<ParameterRun> runs;      ///< of the values, one a parameter

  [[nodiscard]] std::vector<double> starts() const;
  /// Standard errors of the parameters' means, in % of the start values. `covariance`: of the values' coordinates.
  [[nodiscard]] std::vector<double> se_percent(const Eigen::MatrixXd& covariance) const;
};

/// Throws InputError when bounds reach beyond the law's.
EstimatedParameters estimated_parameters(const Study& study, const ElasticModel& model);

}  // namespace diastole
