#include "estimator/law_fit/law_at.hpp"

#include <cmath>

namespace diastole {

std::vector<Eigen::Matrix3d> LawAt::stress(const Eigen::Matrix3d& deformation_gradient,
                                           double fibre_rad) const {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (law_.needs_axes()) {
    axes.topLeftCorner<2, 2>() << std::cos(fibre_rad), -std::sin(fibre_rad), std::sin(fibre_rad),
        std::cos(fibre_rad);
  }
  const Eigen::Matrix3d to_space = deformation_gradient * axes;
  const SymmetricTensor<double> c = symmetric_part(to_space.transpose() * to_space);
  std::vector<Eigen::Matrix3d> parts;
  for (size_t part = 0; part < this->parts(); ++part) {
    const SymmetricTensor<double> s =
        part == 0 ? law_.stress(c, values_) : law_.stress_sensitivity(c, values_, part - 1);
    parts.emplace_back(to_space * full_matrix(s) * to_space.transpose());
  }
  return parts;
}

}  // namespace diastole
