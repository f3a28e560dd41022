#pragma once
// A reconstruction as a record for people and programs, and as a grid for ParaView.

#include "estimator/io/reconstruction_file.hpp"
#include "estimator/io/vtkhdf_file.hpp"
#include "estimator/reconstruction/study_reconstruction.hpp"

namespace diastole {

/// Sections show the last frame: displacement_mm, se_mm (of a component), unseen (share), residual_rms (root mean square
/// of residuals / sigma of the nearest 40 points), volume_ratio.
ReconstructionRecord reconstruction_record(const Study& study, const Measurement& measurement,
                                           const ReconstructionOptions& options,
                                           const StudyReconstruction& reconstruction);

/// The fields exactly, as Bézier hexahedra, one step a frame. Point data: displacement_mm, volume_ratio (the cubic
/// through its values at the Gauss points). Cell data: element, and of the last frame rows, se_mm, unseen.
/// Field data: pressure_kPa. Precondition: there are fields.
BezierGrid reconstruction_grid(const StudyReconstruction& reconstruction);

}  // namespace diastole
