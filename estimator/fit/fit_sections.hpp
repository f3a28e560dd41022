#pragma once
// Drawings of the fitted motion: the deformed body cut across its axis and along it, the material in the cut before and after
// deformation, with the tag planes (or a grid on the material) that it shows, and the measured points near it.

#include <vector>

#include "estimator/fit/fit.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/measurement.hpp"

namespace diastole {

/// The cut across is at the tag slice nearest mid-height (z = 0 without tags), the cut along in the first tag slice along the
/// axis (y = 0 without one).
std::vector<FitSection> draw_sections(const HermiteMesh& mesh, const EstimatedFrame& frame,
                                      const Measurement& measurement);

}  // namespace diastole
