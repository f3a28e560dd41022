#include "estimator/motion_residuals/tag_match.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/mesh/local_field.hpp"

namespace diastole {
namespace {

constexpr int newton_steps = 40;
constexpr double tolerance_mm = 1e-9;
constexpr double least_projection = 0.1;  // of n·F⁻¹n, which is 1 at rest
constexpr double longest_step_mm = 8.0;   // beyond this a step says only the direction

bool inside(const Xi& xi) {
  return std::all_of(xi.begin(), xi.end(), [](double v) { return v >= 0 && v <= 1; });
}

}  // namespace

std::optional<MaterialPoint> find_tag(const PointLocator& deformed, const TagPoint& tag) {
  for (const double sigmas : {0.0, 1.0, -1.0, 2.0, -2.0, 4.0, -4.0}) {
    const auto found = deformed.find(vector_of(tag.x_mm) + sigmas * tag.sigma_mm * vector_of(tag.normal));
    if (found) return found->point;
  }
  return {};
}

std::optional<TagMatch> match_tag(const PointLocator& reference, std::span<const ElementField> deformed,
                                  const TagPoint& tag, const MaterialPoint& guess) {
  const Eigen::Vector3d normal = vector_of(tag.normal);
  const Eigen::Vector3d seen_mm = vector_of(tag.x_mm);
  MaterialPoint point = guess;
  double error_mm = 0;
  for (int step = 0; step < newton_steps; ++step) {
    const auto [X_mm, dX] = local_field(reference.elements()[point.element], point.xi);
    const auto [x_mm, dx] = local_field(deformed[point.element], point.xi);
    const Eigen::Matrix3d dx_inverse = dx.inverse();
    const Eigen::Vector3d miss_mm = seen_mm - x_mm - error_mm * normal;
    const double plane_miss_mm = tag.plane_mm - normal.dot(X_mm);
    const Eigen::Vector3d pulled_normal = (dX * dx_inverse).transpose() * normal;  // F⁻ᵀ n
    const double projection = pulled_normal.dot(normal);
    if (!(projection > least_projection)) return {};

    const double error_change_mm = (pulled_normal.dot(miss_mm) - plane_miss_mm) / projection;
    Eigen::Vector3d xi_change = dx_inverse * (miss_mm - error_change_mm * normal);
    const double length_mm = (dX * xi_change).norm();
    if (length_mm + std::abs(error_change_mm) < tolerance_mm) {
      return TagMatch{point, error_mm, -pulled_normal / projection, X_mm, normal / projection};
    }
    const double damping = std::min(1.0, longest_step_mm / length_mm);
    error_mm += damping * error_change_mm;
    xi_change *= damping;
    Xi moved = point.xi;
    for (size_t k = 0; k < 3; ++k)
      moved[k] += xi_change[static_cast<Eigen::Index>(k)];
    if (inside(moved)) {
      point.xi = moved;
    } else {
      const auto located = reference.find(X_mm + dX * xi_change, point);
      if (!located) return {};
      point = located->point;
    }
  }
  return {};
}

}  // namespace diastole
