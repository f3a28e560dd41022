#pragma once
// What the reconstructed motion says about its data.
//
// ids: wild-points, not-found, sigma, tag-family, slice-offset, far-motion, no-motion, frames-disagree, motion-without-load,
// pressure-offset, volume, unseen-motion, smoothing-edge, not-settled.

#include <memory>
#include <vector>

#include "estimator/io/finding.hpp"
#include "estimator/motion_residuals/tag_planes.hpp"
#include "estimator/reconstruction/coverage.hpp"
#include "estimator/reconstruction/slice_offsets.hpp"
#include "estimator/reconstruction/volume_check.hpp"

namespace diastole {

/// How far a frame's motion has come along that of the most loaded one, by the measured numbers themselves: least squares of
/// them on the most loaded frame's field, so that smoothing, which takes more of a small motion than of a large one, does not
/// matter. The most loaded frame's is 1.
struct MotionAmplitude {
  double value = 0.0;
  double se = 0.0;
  /// What one standard deviation of each of the tag planes' unknowns adds; the same unknown adds to all frames alike.
  Eigen::VectorXd by_planes{};
};
std::vector<MotionAmplitude> motion_amplitudes(const FieldForms& forms, const std::vector<FrameField>& fields,
                                               const TagPlanes& planes);

/// χ² of one tag direction in one frame, or in all of them.
struct FamilyFit {
  size_t family = 0;
  int frame = -1;  ///< -1: all frames together
  size_t rows = 0;
  double freedom = 0.0;  ///< what chi2 should be (residual_shares)
  double chi2 = 0.0;
};
/// Each family over all frames, then each frame of each family.
std::vector<FamilyFit> family_fits(const std::vector<FrameField>& fields, const TagGroups& groups,
                                   size_t tags);

/// All that was found out about the fields of one measurement.
struct MotionEvidence {
  std::unique_ptr<const FieldForms> forms;
  std::vector<FrameField> fields;  ///< loaded frames with points, in order
  TagGroups groups;
  std::vector<MotionAmplitude> amplitudes;
  std::vector<FamilyFit> families;
  std::vector<SliceOffset> slices;
  std::vector<VolumeCheck> volumes;  ///< in the order of the fields
  Coverage coverage;                 ///< of the most loaded frame
};

/// Sound data give an empty list.
std::vector<Finding> motion_findings(const MotionEvidence& evidence);

}  // namespace diastole
