#pragma once
// Noise near the tags' own frequency, which a fit of their motion takes for motion. It is another than the mean where zero-filling or a filter
// has left less of it.

#include "estimator/imaging/tracking/residual_excess.hpp"
#include "estimator/imaging/tracking/tag_view.hpp"

namespace diastole::imaging {

/// A phase's residual power near the tags' frequency over that of white noise of the same variance, where there is nothing but noise: farther
/// off than the motion can follow, and within two thirds of a cycle a spacing of the tags.
double power_near_tags(const TrackedPhase& phase, const ResidualExcess& excess, const SlicePlane& plane,
                       const TagWave& wave, double spacing_mm);

}  // namespace diastole::imaging
