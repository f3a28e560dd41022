#include "estimator/imaging/diffusion/wall_agreement.hpp"

namespace diastole::imaging {
namespace {

Eigen::Matrix3d traceless(const Eigen::Matrix3d& matrix) {
  return matrix - matrix.trace() / 3 * Eigen::Matrix3d::Identity();
}

}  // namespace

Eigen::Matrix3d deviator_in_wall(const WallVoxel& voxel, const Eigen::Matrix3d& change) {
  const Eigen::Matrix3d turn = voxel.middle_axes().transpose() * change;
  return turn * traceless(matrix_of(voxel.voxel->tensor)) * turn.transpose();
}

double agreeing_part(const HelixCourse& course) {
  double agreeing = 0;
  for (size_t d = 0; d < HelixCourse::depths; ++d) {
    if (course.count_at(d) == 0) continue;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(course.mean(d));
    const double outwards = eigen.eigenvectors()(2, 2);
    agreeing += course.count_at(d) * course.mean(d).squaredNorm() * (1 - outwards * outwards);
  }
  return agreeing;
}

DeviatorSize deviator_size(const std::vector<WallVoxel>& voxels) {
  DeviatorSize size;
  for (const WallVoxel& voxel : voxels) {
    size.all += traceless(matrix_of(voxel.voxel->tensor)).squaredNorm();
    size.noise += deviator_noise(voxel.voxel->covariance);
    size.noise_is_known |= voxel.voxel->freedom > 0;
  }
  return size;
}

}  // namespace diastole::imaging
