#pragma once
// Measurements that a model itself would give: the points of a real measurement, placed where the model says, with
// normal noise of any size.

#include <random>
#include <span>
#include <vector>

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/hermite_mesh.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {

/// The loaded points of `design` as they would be seen without error. `position_mm[f]` is the motion of frame f; frames
/// with an empty one, and frame 0, are left out. A tag point stays on its line of error and on its tag plane; points
/// that the body does not hold are dropped.
Measurement exact_measurement(const HermiteMesh& mesh, const Measurement& design,
                              const std::vector<NodeField>& position_mm, const LocatorOptions& locator);

struct NoiseOptions {
  double noise_mm =
      0;  ///< standard deviation of a tag along its normal, of a 3-D point's components; 0: as stated
  bool exact_pressures = false;  ///< or else frame pressures err by their stated sigma
  double share = 1;              ///< of the noise that is added; what is stated stays
};

/// The points of some frames with noise, its size stated with them; the other frames keep their pressures.
Measurement with_noise(const Measurement& exact, std::span<const int> frames, const NoiseOptions& options,
                       std::mt19937_64& generator);

/// `count` of the loaded frames that have points, evenly through them by pressure, the highest always among them.
/// Throws InputError if there are fewer.
std::vector<int> spread_frames(const Measurement& measurement, int count);

// Where a tagging protocol sees material: the points that the stripes of a grid tag have in a set of images
// (Augenstein et al. 2005: stripes every 5 mm in a grid, six short-axis images and six through the axis every
// 30 degrees, pixels of 200 mm / 256).
//
//        /\/\/\/\      two families of stripes in every image, at 45 degrees to its axes, `stripe_mm` apart;
//        \/\/\/\/      along each stripe one point a pixel, where there is tissue
//
// The axis is z. Short-axis images stand at the middles of equal parts of the body's length.

struct TagGrid {
  double stripe_mm = 5.0;
  double pixel_mm = 200.0 / 256.0;
  int short_axis_images = 6;
  int long_axis_images = 6;
};

/// The undeformed places on the body, mm.
std::vector<std::array<double, 3>> grid_places(const HermiteMesh& mesh, const TagGrid& grid);

/// The same material in every loaded frame, as 3-D points that have not moved yet (synthetic_data.hpp moves them),
/// with a sigma of one pixel.
Measurement imaged_design(const HermiteMesh& mesh, const TagGrid& grid, const std::vector<Frame>& frames);

}  // namespace diastole
