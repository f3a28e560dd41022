#pragma once
// Tails of the chi-square and normal laws, and which of many tests are beyond chance.

#include <vector>

namespace diastole::inference {

/// Probability that a chi-square of `dofs` (> 0, need not be whole) exceeds `value`; 1 if that is not positive. A sum of n exponential
/// variables of mean 1 is half a chi-square of 2 n.
double chi_square_tail(double value, double dofs);

/// Probability that a normal variable lies more than `sds` standard deviations to one side of its mean.
double normal_tail(double sds);

/// Benjamini and Hochberg, J. R. Stat. Soc. B 57 (1995) 289: the largest p-value at which the expected part of false
/// discoveries is at most `rate`; 0 if there is none.
double discovery_limit(std::vector<double> p_values, double rate);

}  // namespace diastole::inference
