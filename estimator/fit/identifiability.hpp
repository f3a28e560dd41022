#pragma once
// Which combinations of parameters the data see, and which they do not.

#include <vector>

#include "estimator/fit/fit.hpp"
#include "estimator/io/fit_file.hpp"

namespace diastole {

/// The eigen-directions of the relative covariance of the whole, positive parameters that are not on a bound, from
/// the least certain one. `first[i]` is the place of parameter i among the fit's values. Empty for fewer than two.
std::vector<FittedDirection> directions_of(const FitRecord& record, const FitOutcome& fit,
                                           const std::vector<size_t>& first);

/// The same in sentences: pairs that trade off, the combination that is known worst, the one that is known best.
std::vector<std::string> identifiability_remarks(const FitRecord& record);

}  // namespace diastole
