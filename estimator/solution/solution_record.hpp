#pragma once
// What the report shows of a solution: a short-axis section half-way up the cavity, a long-axis section through
// the axis z, and a profile through the wall where the two meet (on the side of +x).

#include "estimator/fe/elastic_model.hpp"
#include "estimator/io/solution_file.hpp"

namespace diastole {

/// The solution's part of a record; study, mesh and parameters are the caller's to add. Precondition: the state
/// is this model's.
SolutionRecord solution_record(const ElasticModel& model, const ElasticState& state);

}  // namespace diastole
