#include "estimator/imaging/geometry/wild_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/imaging/geometry/spatial_median.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

using QuadricRow = Eigen::Matrix<double, 9, 1>;

/// Fewer points than these leave a wall's ellipsoid open; its nine numbers fit them all.
constexpr size_t least_of_wall = 18;
constexpr double wild_scatters = 8;
constexpr double wild_sizes = 0.5;
/// The base is about as far from the walls' middle as their points are.
constexpr double wild_base_sizes = 3;

struct WallPlaces {
  std::vector<size_t> points;  // indices into the guide points
  std::vector<Eigen::Vector3d> places;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double size_mm = 0;  // the median distance from the middle
};

WallPlaces places_of_wall(const GuidePoints& guide, bool inner) {
  WallPlaces wall;
  for (size_t i = 0; i < guide.points.size(); ++i) {
    const GuidePoint& point = guide.points[i];
    if (point.surface == GuideSurface::base || is_inner(point.surface) != inner) continue;
    wall.points.push_back(i);
    wall.places.push_back(point.place_mm);
  }
  if (wall.places.empty()) return wall;
  wall.middle = spatial_median(wall.places);
  std::vector<double> distances;
  for (const Eigen::Vector3d& place : wall.places)
    distances.push_back((place - wall.middle).norm());
  wall.size_mm = signal::median(distances);
  return wall;
}

QuadricRow quadric_row(const Eigen::Vector3d& x) {
  QuadricRow row;
  row << 1, x, x.x() * x.x() - x.y() * x.y(), x.x() * x.x() + x.y() * x.y() - 2 * x.z() * x.z(),
      x.x() * x.y(), x.x() * x.z(), x.y() * x.z();
  return row;
}

/// Exact for a sphere; less than the true one far outside a long ellipsoid.
double distance_from_quadric(const QuadricRow& q, const Eigen::Vector3d& x) {
  const double value = x.squaredNorm() - quadric_row(x).dot(q);
  Eigen::Matrix3d twice;
  twice << 2 * (q[4] + q[5]), q[6], q[7],  //
      q[6], 2 * (q[5] - q[4]), q[8],       //
      q[7], q[8], -4 * q[5];
  const double slope = (2 * x - q.segment<3>(1) - twice * x).norm();
  return 2 * std::abs(value) / std::max(1e-12, slope + std::sqrt(std::max(0.0, slope * slope - 4 * value)));
}

/// Of each of the wall's points.
std::vector<bool> wild_of_wall(const WallPlaces& wall) {
  // In units of the wall's size.
  std::vector<Eigen::Vector3d> scaled;
  for (const Eigen::Vector3d& place : wall.places)
    scaled.emplace_back((place - wall.middle) / wall.size_mm);
  std::vector<double> distances(scaled.size(), 0);
  double scatter = 1;
  for (int i = 0; i < 20; ++i) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(9, 9);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(9);
    for (size_t k = 0; k < scaled.size(); ++k) {
      const QuadricRow row = quadric_row(scaled[k]);
      const double square = scaled[k].squaredNorm();
      const double weight = 1 / (std::pow(1 + square, 2) * (1 + std::pow(distances[k] / scatter, 2)));
      normal += weight * row * row.transpose();
      right += weight * square * row;
    }
    const Eigen::VectorXd q = normal.completeOrthogonalDecomposition().solve(right);
    std::transform(scaled.begin(), scaled.end(), distances.begin(),
                   [&](const Eigen::Vector3d& x) { return distance_from_quadric(q, x); });
    // Walls are no ellipsoids to better than a fiftieth.
    scatter = std::max(0.02, signal::deviation_of_normal(distances));
  }
  std::vector<bool> wild;
  for (const double distance : distances)
    wild.push_back(distance > std::max(wild_scatters * scatter, wild_sizes));
  return wild;
}

double distance_from_others_mm(const GuidePoint& point, const GuidePoints& others) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const GuidePoint& other : others.points)
    if ((other.surface == GuideSurface::base) == (point.surface == GuideSurface::base) &&
        is_inner(other.surface) == is_inner(point.surface))
      nearest = std::min(nearest, (other.place_mm - point.place_mm).norm());
  return nearest;
}

}  // namespace

GuidePoints without_wild_points(const GuidePoints& guide, std::vector<Finding>& findings) {
  std::vector<bool> is_wild(guide.points.size(), false);
  for (const bool inner : {true, false}) {
    const WallPlaces wall = places_of_wall(guide, inner);
    if (wall.points.size() < least_of_wall || !(wall.size_mm > 0)) continue;
    const std::vector<bool> wild = wild_of_wall(wall);
    if (5 * static_cast<size_t>(std::count(wild.begin(), wild.end(), true)) > wild.size()) return guide;
    for (size_t k = 0; k < wild.size(); ++k)
      is_wild[wall.points[k]] = wild[k];
    if (inner) continue;
    for (size_t i = 0; i < guide.points.size(); ++i)
      if (guide.points[i].surface == GuideSurface::base)
        is_wild[i] = (guide.points[i].place_mm - wall.middle).norm() > wild_base_sizes * wall.size_mm;
  }
  GuidePoints kept = guide;
  kept.points.clear();
  for (size_t i = 0; i < guide.points.size(); ++i)
    if (!is_wild[i]) kept.points.push_back(guide.points[i]);
  for (size_t i = 0; i < guide.points.size(); ++i) {
    if (!is_wild[i]) continue;
    const GuidePoint& point = guide.points[i];
    const double nearest_mm = distance_from_others_mm(point, kept);
    findings.push_back(
        {Severity::warning, "wild-point",
         fmt::format("a point of the {} at ({:.1f}, {:.1f}, {:.1f}) mm lies {:.0f} mm from all others of it",
                     name_of(point.surface), point.place_mm.x(), point.place_mm.y(), point.place_mm.z(),
                     nearest_mm),
         fmt::format("phase {}, slice {}", guide.phases[point.phase], guide.slices[point.slice]), nearest_mm,
         "mm", "Look at its coordinates; it is left out."});
  }
  return kept;
}

}  // namespace diastole::imaging
