#pragma once
// The gap after each added effect as bars on a logarithmic scale, with the noise floor:
//
//   base model        |██████████████████████████| 14.2
//   + hose-compliance |██|░░░░░░░░░░░░░░░░░░░░░░░| 1.1        ░ what this effect took away
//                      ┆ 1: noise

#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::report {

/// Precondition: `steps` is not empty; the first is the base model.
std::string waterfall(const std::vector<explain::Step>& steps, double floor);

}  // namespace diastole::report
