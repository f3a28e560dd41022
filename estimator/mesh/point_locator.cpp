#include "estimator/mesh/point_locator.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "estimator/mesh/local_field.hpp"

namespace diastole {
namespace {

constexpr int newton_steps = 30;
constexpr double inside_slack_xi = 1e-9;

double overshoot(const Xi& xi) {
  double most = 0.0;
  for (const double v : xi)
    most = std::max({most, -v, v - 1.0});
  return most < inside_slack_xi ? 0.0 : most;
}

}  // namespace

PointLocator::PointLocator(const HermiteMesh& mesh, std::span<const double> positions_mm,
                           LocatorOptions options)
    : options_(options), elements_(element_fields(mesh, positions_mm)) {
  constexpr double margin = 1.1;  // cubic edges bulge beyond the sampled places
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const Eigen::Vector3d centre = local_value(elements_[e], {0.5, 0.5, 0.5});
    const double low = -options.outside_xi;
    const double high = 1.0 + options.outside_xi;
    double radius = 0.0;
    for (size_t sample = 0; sample < 27; ++sample) {
      const auto place = [&](size_t digit) { return digit == 0 ? low : digit == 1 ? 0.5 : high; };
      const Xi xi{place(sample % 3), place(sample / 3 % 3), place(sample / 9)};
      radius = std::max(radius, (local_value(elements_[e], xi) - centre).norm());
    }
    spheres_.push_back({centre, margin * radius});
  }
}

std::optional<LocatedPoint> PointLocator::find_in(size_t element, const Eigen::Vector3d& place_mm, Xi start,
                                                  double outside_xi) const {
  constexpr double longest_step_xi = 0.5;
  constexpr double wander_xi = 1.0;  // an iterate may leave the element this far on its way
  Xi xi = start;
  for (int step = 0; step < newton_steps; ++step) {
    const LocalField here = local_field(elements_[element], xi);
    const Eigen::Vector3d miss = place_mm - here.value;
    if (miss.norm() <= options_.tolerance_mm) {
      const double beyond = overshoot(xi);
      if (beyond > outside_xi) return {};
      return LocatedPoint{{element, xi}, beyond};
    }
    Eigen::Vector3d change = here.slope.inverse() * miss;
    if (!change.allFinite()) return {};
    const double longest = change.cwiseAbs().maxCoeff();
    if (longest > longest_step_xi) change *= longest_step_xi / longest;
    for (size_t k = 0; k < 3; ++k) {
      xi[k] = std::clamp(xi[k] + change[static_cast<Eigen::Index>(k)], -wander_xi, 1.0 + wander_xi);
    }
  }
  return {};
}

std::optional<LocatedPoint> PointLocator::find_beside(const Eigen::Vector3d& place_mm,
                                                      const MaterialPoint& guess) const {
  return find_in(guess.element, place_mm, guess.xi, std::numeric_limits<double>::infinity());
}

std::optional<LocatedPoint> PointLocator::find(const Eigen::Vector3d& place_mm,
                                               std::optional<MaterialPoint> guess) const {
  std::optional<LocatedPoint> best;
  const auto consider = [&](size_t element, const Xi& start) {
    const std::optional<LocatedPoint> found = find_in(element, place_mm, start, options_.outside_xi);
    if (found && (!best || found->overshoot_xi < best->overshoot_xi)) best = found;
    return best && best->overshoot_xi == 0.0;
  };
  if (guess && consider(guess->element, guess->xi)) return best;
  std::vector<std::pair<double, size_t>> nearby;
  for (size_t e = 0; e < spheres_.size(); ++e) {
    const double distance = (place_mm - spheres_[e].centre_mm).norm();
    if (distance <= spheres_[e].radius_mm) nearby.emplace_back(distance, e);
  }
  std::sort(nearby.begin(), nearby.end());
  for (const auto& [distance, e] : nearby) {
    if (consider(e, {0.5, 0.5, 0.5})) break;
  }
  return best;
}

}  // namespace diastole
