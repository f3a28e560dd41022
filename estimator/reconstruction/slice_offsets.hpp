#pragma once
// Slices that lie in the wrong place: a common offset of a slice's residuals.
//
// The model y = G u + C o + noise, with u as smooth as cross-validation found it and one offset o a slice. Eliminating u,
//
//   S = Cᵀ (1 − K) C,   t = Cᵀ (1 − K) y = Cᵀ r,      o = S⁻¹ t,   covariance S⁻¹         K = G H⁻¹ Gᵀ
//
// so the field's own bending towards a misplaced slice is accounted for. S and t of the frames add up: a slice is
// misplaced in all of them alike. Slices are taken up one by one, the most significant first, the others then judged
// beside those found, because the field bends its neighbours' residuals as well.
//
// Offsets along n of all slices that a rigid shift of the body would make alike cannot be seen; none is invented. An offset is determined by
// what the field leaves of it, the share S / C'C: a field that takes up nearly all of it leaves the mesh's error and unfinished rounds,
// and dividing these by a small S would make a large offset of them.

#include <vector>

#include "estimator/reconstruction/frame_field.hpp"
#include "estimator/reconstruction/tag_groups.hpp"

namespace diastole {

struct SliceOffset {
  size_t slice = 0;        ///< index in TagGroups::slices
  double offset_mm = 0.0;  ///< along the tags' normal; of those not displaced: if this slice alone were
  double se_mm = 0.0;      ///< infinite when nothing was measured
  bool displaced = false;
};

/// One entry a slice, in their order. Displaced are offsets of at least five standard errors that leave at least 0.1 mm and half of the points'
/// own sigma in the residuals: the mesh's error is no displacement.
std::vector<SliceOffset> slice_offsets(const std::vector<FrameField>& fields, const TagGroups& groups,
                                       std::span<const TagPoint> tags);

}  // namespace diastole
