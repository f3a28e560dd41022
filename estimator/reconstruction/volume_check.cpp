#include "estimator/reconstruction/volume_check.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "estimator/fe/body_volume.hpp"
#include "estimator/fe/gauss_points.hpp"

namespace diastole {

namespace {

/// What smoothing makes of the volume of a motion, by smoothing it as if it were the frame's data (twicing: J. W. Tukey, Exploratory
/// Data Analysis (1977) 526).
double smoothing_error_mm3(const FieldForms& forms, const SmoothedSystem& system,
                           const Eigen::VectorXd& motion) {
  const HermiteMesh& mesh = forms.space.mesh();
  const auto volume_after = [&](const Eigen::VectorXd& q) {
    NodeField position_mm = mesh.reference();
    std::ranges::transform(position_mm, forms.space.field_of(q), position_mm.begin(), std::plus<>());
    return volume_mm3(mesh, position_mm);
  };
  const Eigen::VectorXd seen = system.weighted_rows() * motion;
  return volume_after(system.solve(system.weighted_rows().transpose() * seen).col(0)) - volume_after(motion);
}

/// The largest motion, made as large as this frame's as its points see it.
Eigen::VectorXd scaled_to(const SmoothedSystem& system, const Eigen::VectorXd& largest) {
  const Eigen::VectorXd own = system.weighted_rows() * system.solution();
  const Eigen::VectorXd seen = system.weighted_rows() * largest;
  return own.dot(seen) / std::max(seen.squaredNorm(), 1e-300) * largest;
}

}  // namespace

VolumeCheck check_volume(const FieldForms& forms, const FrameField& field, const FrameField& largest) {
  const HermiteMesh& mesh = forms.space.mesh();
  const GaussTables& tables = gauss_tables();
  VolumeCheck check;
  std::vector<Functional> of_elements;
  Eigen::VectorXd of_body = Eigen::VectorXd::Zero(forms.space.unknowns());
  std::vector<std::pair<double, double>> errors;  // |J - 1|, volume
  double moved_mm3 = 0.0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    Functional mean{e, ElementRow::Zero()};
    double element_mm3 = 0.0;
    for (size_t q = 0; q < gauss_points; ++q) {
      const MaterialPoint point{e, tables.xi[q]};
      const double part_mm3 =
          tables.weight[q] * std::abs(mesh.xi_gradient(mesh.reference(), point).determinant());
      const double ratio = mesh.reference_gradient(field.position_mm, point).determinant();
      element_mm3 += part_mm3 * ratio;
      check.rms += part_mm3 * (ratio - 1) * (ratio - 1);
      errors.emplace_back(std::abs(ratio - 1), part_mm3);
      mean.coefficients += part_mm3 * volume_change(mesh, field.position_mm, point).coefficients;
    }
    forms.space.add_to(of_body, mean);
    mean.coefficients /= forms.sobolev.element_volume_mm3[e];
    of_elements.push_back(mean);
    moved_mm3 += element_mm3;
    check.elements.push_back({element_mm3 / forms.sobolev.element_volume_mm3[e], 0.0});
  }
  const double rest_mm3 = forms.sobolev.volume_mm3;
  check.mean_ratio = moved_mm3 / rest_mm3;
  check.rms = std::sqrt(check.rms / rest_mm3);
  of_body /= rest_mm3;
  const SmoothedSystem& system = *field.system;
  for (const Eigen::VectorXd& motion : {system.solution(), scaled_to(system, largest.system->solution())})
    check.smoothing_error =
        std::max(check.smoothing_error, std::abs(smoothing_error_mm3(forms, system, motion)) / rest_mm3);
  check.se = std::hypot(std::sqrt(of_body.dot(field.system->solve(of_body).col(0))), check.smoothing_error);
  const std::vector<double> variances = field.system->variances(of_elements);
  for (size_t e = 0; e < variances.size(); ++e)
    check.elements[e].se = std::sqrt(variances[e]);
  std::sort(errors.begin(), errors.end());
  check.largest = errors.back().first;
  double below_mm3 = 0.0;
  for (const auto& [error, part_mm3] : errors) {
    below_mm3 += part_mm3;
    check.p95 = error;
    if (below_mm3 >= 0.95 * rest_mm3) break;
  }
  return check;
}

}  // namespace diastole
