#include "estimator/solution/wall_profile.hpp"

#include <optional>

#include "estimator/mesh/point_locator.hpp"

namespace diastole {
namespace {

constexpr size_t steps = 400;  // over twice the body's extent: no wall is thinner than a step in practice
constexpr int halvings = 40;   // of a step, to find a face
constexpr double inside_xi = 1e-6;  // how far beyond a face still counts as on it

/// Between a place outside and one inside the body: the last one inside.
double find_face(double outside, double inside, const auto& lies_inside) {
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (outside + inside);
    (lies_inside(middle) ? inside : outside) = middle;
  }
  return inside;
}

}  // namespace

WallProfile cross_wall(const HermiteMesh& mesh, const Eigen::Vector3d& from_mm,
                       const Eigen::Vector3d& direction, size_t count) {
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = inside_xi, .tolerance_mm = 1e-10});
  const Eigen::Vector3d unit = direction.normalized();
  const auto found = [&](double s) { return locator.find(from_mm + s * unit); };
  const auto lies_inside = [&](double s) { return found(s).has_value(); };
  const double step = 2.0 * mesh.extent_mm() / static_cast<double>(steps);
  std::optional<double> first;
  std::optional<double> last;
  for (size_t i = 0; i <= steps; ++i) {
    const double s = static_cast<double>(i) * step;
    if (lies_inside(s)) {
      if (!first) first = s;
      last = s;
    } else if (first) {
      break;
    }
  }
  WallProfile profile;
  if (!first) return profile;
  const double begin = *first == 0.0 ? 0.0 : find_face(*first - step, *first, lies_inside);
  const double end = find_face(*last + step, *last, lies_inside);
  for (size_t i = 0; i < count; ++i) {
    const double depth_mm = (end - begin) * static_cast<double>(i) / static_cast<double>(count - 1);
    const std::optional<LocatedPoint> located = found(begin + depth_mm);
    if (!located) continue;  // a hairline between two elements
    profile.depth_mm.push_back(depth_mm);
    profile.points.push_back(located->point);
  }
  return profile;
}

}  // namespace diastole
