#pragma once
// Where a tagging protocol sees material: the points that the stripes of a grid tag have in a set of images
// (Augenstein et al. 2005: stripes every 5 mm in a grid, six short-axis images and six through the axis every
// 30 degrees, pixels of 200 mm / 256).
//
//        /\/\/\/\      two families of stripes in every image, at 45 degrees to its axes, `stripe_mm` apart;
//        \/\/\/\/      along each stripe one point a pixel, where there is tissue
//
// The axis is z. Short-axis images stand at the middles of equal parts of the body's length.

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

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
