#pragma once
// How far fibres at one depth of a wall agree, and lie in it, when they are seen in the wall's own coordinates after a change of gradient axes:
//
//   agreement(P) = sum over depths of n |M|² (1 - f_r²) / sum of |D|²     M = mean of QᵀPDPᵀQ, f its first eigenvector
//
// D is a voxel's deviator, Q its wall axes; 1 - f_r² because fibres run in the wall: turned about the ventricle's axis they would agree as well.

#include <Eigen/Dense>
#include <vector>

#include "estimator/imaging/diffusion/wall_voxels.hpp"
#include "estimator/mesh/helix_course.hpp"

namespace diastole::imaging {

/// QᵀPDPᵀQ
Eigen::Matrix3d deviator_in_wall(const WallVoxel& voxel, const Eigen::Matrix3d& change);

/// The sum over a course's depths.
double agreeing_part(const HelixCourse& course);

/// The sums of |D|² over voxels; what noise makes of it by the tensors' covariances, which no table makes agree.
struct DeviatorSize {
  double all = 0, noise = 0;
  bool noise_is_known = false;  ///< images have residuals
  /// 0 ... 1: of `all` the part that is not noise, as far as that is known.
  [[nodiscard]] double signal_share() const { return noise_is_known && all > noise ? 1 - noise / all : 0; }
};
DeviatorSize deviator_size(const std::vector<WallVoxel>& voxels);

}  // namespace diastole::imaging
