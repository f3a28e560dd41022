#pragma once
// The tags' planes at rest, as the images have them.

#include <Eigen/Core>
#include <vector>

#include "estimator/imaging/tracking/materials.hpp"
#include "estimator/imaging/tracking/tag_view.hpp"

namespace diastole::imaging {

struct RestWaves {
  std::vector<TagWave> waves;  ///< one a direction
  /// A direction: the information on what its waves may err, cycles^-2, but for the noise near the tags' frequency (tag_noise.hpp). The wave
  /// vector's two components count times the slice's extent, then comes the phase in the slice's middle.
  std::vector<Eigen::Matrix3d> information;
};

/// The view's waves, corrected by tissue in the first phase; if that comes late, by still water in all phases too.
RestWaves waves_at_rest(const TagView& view, const MaterialMap& first);

}  // namespace diastole::imaging
