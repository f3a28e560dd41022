#pragma once
// Any law with one more family of fibres, in the plane of its first two material axes:
//
//   W + k1/(2 k2) (exp(k2 (I4 - 1)^2) - 1),   I4 = a . C a,   a = (cos angle, sin angle, 0)
//
// k2 = 0 is k1/2 (I4 - 1)^2; k1 = 0 is the law itself. The fibres bear compression as those of fibre_reinforced.cpp do.

#include "estimator/materials/law.hpp"

namespace diastole {

/// The base's parameters, then k1_kPa, k2, angle_deg. Lives as long as the program, as `base` must.
const Law& reinforced(const Law& base);

}  // namespace diastole
