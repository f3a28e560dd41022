#pragma once
// What a reader of a fit should know beyond its numbers, in whole sentences.

#include <string>
#include <vector>

#include "estimator/fit/fit.hpp"
#include "estimator/io/fit_file.hpp"

namespace diastole {

std::vector<std::string> remarks_on(const FitRecord& record, const FitOutcome& fit);

}  // namespace diastole
