#pragma once
// What a study asks a fit to find.

#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

/// Parallel vectors in the study's order: one entry for a whole parameter, one an element for a regional one.
struct EstimatedParameters {
  std::vector<EstimatedParameter> values;
  std::vector<ParameterGroup> groups;  ///< which of the model's parameters each value sets
  std::vector<SmoothRegion> smooth;    ///< the regional parameters that are smooth
};

/// Throws InputError when a lower bound is not a value that the law allows.
EstimatedParameters estimated_parameters(const Study& study, const ElasticModel& model);

/// How many values a parameter has.
size_t value_count(const StudyParameter& parameter, size_t elements);

}  // namespace diastole
