#pragma once
// Whether a gradient table is turned by a few degrees against the images, as one is that was not turned with them: the rotation R that maximises the
// agreement of estimator/imaging/diffusion/wall_agreement.hpp.
//
// A ventricle's own field must not look like it. Helix angles that differ between the septum and the free wall by 2a degrees are, over all of the
// circumference, a rotation of a degrees across the long axis. So each twelfth of the circumference has a helix of its own, and only that
// fibres leave the wall is left as evidence: outwards on one side and inwards on the other, which no wall's fibres do. A rotation about the
// long axis is a transverse angle that is the same everywhere, and is not distinguished from one.

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "estimator/imaging/diffusion/wall_voxels.hpp"

namespace diastole::imaging {

struct GradientTurn {
  Eigen::Matrix3d rotation =
      Eigen::Matrix3d::Identity();  ///< of directions that were changed before, patient axes
  double angle_deg = 0;
  double across_deg = 0;  ///< the part of the rotation vector across the ventricle's long axis
  double sigma_deg = 0;   ///< of the rotation vector, from leaving out a sixth of the long axis at a time

  [[nodiscard]] bool is_clear() const { return clear(angle_deg); }
  /// Also without the part that a field of the ventricle could be.
  [[nodiscard]] bool is_no_field() const { return clear(across_deg); }
  /// "12 degrees about (0.50, 0.86, 0.05)"
  [[nodiscard]] std::string name() const;

 private:
  [[nodiscard]] bool clear(double part_deg) const;
};

/// Precondition: `voxels` is not empty.
GradientTurn find_gradient_turn(const std::vector<WallVoxel>& voxels, const Eigen::Matrix3d& change);

}  // namespace diastole::imaging
