#pragma once
// What a reader of a fit should know beyond its numbers, in whole sentences.

#include <string>
#include <vector>

#include "estimator/fit/fit.hpp"
#include "estimator/io/fit_file.hpp"

namespace diastole {

/// The eigen-directions of the relative covariance of the whole, positive parameters that are not on a bound, from
/// the least certain one. `first[i]` is the place of parameter i among the fit's values. Empty for fewer than two.
std::vector<FittedDirection> directions_of(const FitRecord& record, const FitOutcome& fit,
                                           const std::vector<size_t>& first);

std::vector<std::string> remarks_on(const FitRecord& record, const FitOutcome& fit);

}  // namespace diastole
