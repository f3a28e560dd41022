#pragma once
// A fitted wall as an image shows it: where it crosses the image's plane.

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "estimator/imaging/dicom/slice_plane.hpp"
#include "estimator/imaging/geometry/ventricle_fit.hpp"

namespace diastole::imaging {

/// Places of one wall up to the base plane, in patient coordinates: `along` from the apex, for each of `around`.
struct WallNet {
  static constexpr Eigen::Index around = 64, along = 40;
  Eigen::Matrix3Xd places_mm;
};

/// `side`: -1/2 (endocardium) to 1/2 (epicardium). Throws std::domain_error where the wall does not meet the base plane.
WallNet wall_net(const ProlateFrame& frame, const VentricleWalls& walls, double side);

using Segment = std::array<Eigen::Vector2d, 2>;  ///< in-plane mm from the first pixel's centre

/// Pieces of lines, in no order. `shift_mm`: by which the slice was seen displaced (SliceShift).
std::vector<Segment> wall_outline(const WallNet& net, const SlicePlane& plane,
                                  const Eigen::Vector3d& shift_mm);

}  // namespace diastole::imaging
