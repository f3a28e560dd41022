#include "estimator/model/inclusion_stiffness.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/contract/angle.hpp"

namespace diastole {

InclusionStiffness::InclusionStiffness(const HermiteMesh& mesh) : samples_(mesh.element_count()) {
  // Ends of the parts of [0, 1] that the four Gauss points stand for: sums of their weights.
  constexpr std::array<double, 5> ends{0.0, 0.1739274225687269, 0.5, 0.8260725774312731, 1.0};

  for (size_t e = 0; e < mesh.element_count(); ++e) {
    Samples& samples = samples_[e];
    samples.middle_mm = mesh.value(mesh.reference(), {e, {0.5, 0.5, 0.5}});
    samples.reach_mm = 0.0;
    for (const Xi& point : gauss_tables().xi) {
      std::array<size_t, 3> part{};
      for (size_t k = 0; k < 3; ++k)
        while (point[k] > ends[part[k] + 1])
          ++part[k];
      for (size_t i = 0; i < samples_a_point; ++i) {
        const std::array<size_t, 3> digits{i % samples_a_side, i / samples_a_side % samples_a_side,
                                           i / samples_a_side / samples_a_side};
        Xi xi{};
        for (size_t k = 0; k < 3; ++k)
          xi[k] = std::lerp(ends[part[k]], ends[part[k] + 1],
                            (static_cast<double>(digits[k]) + 0.5) / samples_a_side);
        samples.X_mm.push_back(mesh.value(mesh.reference(), {e, xi}));
        samples.reach_mm = std::max(samples.reach_mm, (samples.X_mm.back() - samples.middle_mm).norm());
      }
    }
  }
}

GaussNumbers InclusionStiffness::of(const Inclusion& inclusion) const {
  const double theta = inclusion.theta_deg * rad_per_deg;
  const Eigen::Vector3d centre_mm(inclusion.radius_mm * std::cos(theta),
                                  inclusion.radius_mm * std::sin(theta), inclusion.z_mm);
  // Where the edge's hyperbolic tangent has ended.
  const double longest_mm = std::ranges::max(inclusion.semi_axes_mm);
  const double shortest_mm = std::ranges::min(inclusion.semi_axes_mm);
  const double end_mm = longest_mm * (1.0 + 8.0 * inclusion.edge_width_mm / shortest_mm);
  GaussNumbers numbers(samples_.size());
  for (size_t e = 0; e < samples_.size(); ++e) {
    numbers[e].fill(1.0);
    if ((samples_[e].middle_mm - centre_mm).norm() > samples_[e].reach_mm + end_mm) continue;
    for (size_t q = 0; q < gauss_points; ++q) {
      double sum = 0.0;
      for (size_t i = 0; i < samples_a_point; ++i) {
        const Eigen::Vector3d& X_mm = samples_[e].X_mm[q * samples_a_point + i];
        sum += inclusion.stiffness({X_mm[0], X_mm[1], X_mm[2]});
      }
      numbers[e][q] = sum / samples_a_point;
    }
  }
  return numbers;
}

}  // namespace diastole
