#pragma once
// What the reconstructed motion says about its data.
//
// ids: wild-points, not-found, sigma, tag-family, slice-offset, far-motion, no-motion, frames-disagree, motion-without-load,
// pressure-offset, volume, unseen-motion, smoothing-edge, not-settled.

#include <vector>

#include "estimator/io/finding.hpp"
#include "estimator/reconstruction/coverage.hpp"
#include "estimator/reconstruction/slice_offsets.hpp"
#include "estimator/reconstruction/volume_check.hpp"

namespace diastole {

/// How far a frame's motion has come along that of the last one, by the measured numbers themselves: least squares of
/// them on the last frame's field, so that smoothing, which takes more of a small motion than of a large one, does not
/// matter. The last frame's is 1.
struct MotionAmplitude {
  double value = 0.0;
  double se = 0.0;
};
std::vector<MotionAmplitude> motion_amplitudes(const FieldForms& forms,
                                               const std::vector<FrameField>& fields);

/// Pressure at which the motion would vanish, extrapolated from the frames by a parabola p(amplitude). Needs four
/// frames; the standard error is infinite with fewer.
struct PressureAtNoMotion {
  double value_kPa = 0.0;
  double se_kPa = 0.0;
};
PressureAtNoMotion pressure_at_no_motion(const std::vector<FrameField>& fields,
                                         const std::vector<MotionAmplitude>& amplitudes);

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

/// All that was found out about the fields of one measurement; volumes, in the order of the fields.
struct MotionEvidence {
  const FieldForms& forms;
  const std::vector<FrameField>& fields;
  const TagGroups& groups;
  const std::vector<MotionAmplitude>& amplitudes;
  const std::vector<FamilyFit>& families;
  const std::vector<SliceOffset>& slices;
  const std::vector<VolumeCheck>& volumes;
  const Coverage& coverage;  ///< of the last frame
};

/// Sound data give an empty list.
std::vector<Finding> motion_findings(const MotionEvidence& evidence);

}  // namespace diastole
