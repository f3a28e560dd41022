#pragma once
// Drawings of the fitted motion: the annulus cut across its axis and along it, before and after deformation,
// with the tag planes (or a grid on the material) that the cut shows, and the measured points near it.

#include <vector>

#include "estimator/fit/fit.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

/// The cut across is at the tag slice nearest mid-height (z = 0 without tags), the cut along is the plane y =
/// 0.
std::vector<FitSection> draw_sections(const AnnulusSpecimen& annulus, const HermiteMesh& mesh,
                                      const EstimatedFrame& frame, const Measurement& measurement);

}  // namespace diastole
