#pragma once
// A tabulated curve as a function of formulas: the natural cubic spline through its points, straight beyond them.

#include <vector>

#include "estimator/expressions/formula.hpp"

namespace diastole::expressions {

/// Preconditions: two points or more, `at` strictly increasing, a value for each.
Curve tabulated_curve(const std::vector<double>& at, const std::vector<double>& values, const Unit& of,
                      const Unit& unit);

}  // namespace diastole::expressions
