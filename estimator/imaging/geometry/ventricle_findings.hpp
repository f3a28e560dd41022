#pragma once
// What a user should know before believing a fitted ventricle: slices that make no plane, errors larger than stated, a size that no
// heart has.

#include <vector>

#include "estimator/imaging/geometry/ventricle_fit.hpp"

namespace diastole::imaging {

/// ids: no-plane, noise, unit.
std::vector<Finding> ventricle_findings(const VentricleFit& fit, const GuidePoints& guide,
                                        const std::vector<GuideSlice>& slices,
                                        const VentricleOptions& options);

}  // namespace diastole::imaging
