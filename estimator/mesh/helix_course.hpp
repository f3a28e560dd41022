#pragma once
// How the helix angle goes through a wall, from tensors (or ffᵀ of directions, whose sign has no meaning) in wall coordinates: their means by
// depth, whose first eigenvectors' angles from e_c towards e_l are unwrapped from one depth to the next.

#include <Eigen/Dense>
#include <array>
#include <cstddef>

namespace diastole {

class HelixCourse {
 public:
  static constexpr size_t depths = 6;

  /// `tensor` in the axes e_c, e_l, r at a depth of 0 (inside) to 1.
  void add(double depth, const Eigen::Matrix3d& tensor);

  [[nodiscard]] size_t count() const;
  [[nodiscard]] double count_at(size_t depth) const { return counts_[depth]; }
  /// Precondition: count_at(depth) > 0.
  [[nodiscard]] Eigen::Matrix3d mean(size_t depth) const { return sums_[depth] / counts_[depth]; }

  /// The angle at each depth, unwrapped, the middle one within a quarter turn of the circumference; where nothing was added that of the
  /// nearest depth further in, or out. Precondition: count() > 0.
  [[nodiscard]] std::array<double, depths> angles_rad() const;

 private:
  std::array<Eigen::Matrix3d, depths> sums_{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(),
                                            Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(),
                                            Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  std::array<double, depths> counts_{};
};

/// Linear between the middles of the depths, and on beyond them.
double angle_at(const std::array<double, HelixCourse::depths>& angles_rad, double depth);

}  // namespace diastole
