#pragma once
// Standard errors and intervals of values whose coordinates were estimated. An interval is symmetric in the coordinate:
// for a logarithmic scale it is a factor up and down.

#include <array>

#include "estimator/inference/parameter_space.hpp"

namespace diastole::inference {

/// Two-sided 90 % and 95 % of the normal distribution, in standard deviations.
inline constexpr double normal_90 = 1.644853626951473;
inline constexpr double normal_95 = 1.959963984540054;

/// Of the value, from the standard deviation of its coordinate.
double standard_error(const Parameter& parameter, double coordinate, double sd);

/// Values `half_width` of the coordinate away, the smaller one first; `half_width` is normal_95 * sd, say.
std::array<double, 2> interval(const Parameter& parameter, double coordinate, double half_width);

/// The value that Student's t exceeds in size with the probability `two_sided`.
double student_quantile(double dof, double two_sided);

}  // namespace diastole::inference
