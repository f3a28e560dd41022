#include "estimator/imaging/geometry/ventricle_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector3d;

struct Mean {
  Vector3d sum = Vector3d::Zero();
  size_t count = 0;
  void add(const Vector3d& place) {
    sum += place;
    ++count;
  }
  [[nodiscard]] Vector3d value() const { return sum / static_cast<double>(count); }
};

/// From apex to base, where no point of the base is given: across the short-axis slices, towards the wider ones.
Vector3d axis_of_stack(const GuidePoints& guide, const std::vector<GuideSlice>& slices) {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  for (const GuideSlice& slice : slices)
    if (slice.is_plane) normals += slice.normal * slice.normal.transpose();
  const Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normals).eigenvectors().col(2);
  // The slope of the distance from the stack's line by the height.
  Mean all;
  for (const GuidePoint& point : guide.points)
    all.add(point.place_mm);
  double covariance = 0, mean_distance = 0;
  for (const GuidePoint& point : guide.points) {
    const Vector3d from_centre = point.place_mm - all.value();
    mean_distance += from_centre.cross(axis).norm() / static_cast<double>(all.count);
  }
  for (const GuidePoint& point : guide.points) {
    const Vector3d from_centre = point.place_mm - all.value();
    covariance += from_centre.dot(axis) * (from_centre.cross(axis).norm() - mean_distance);
  }
  return covariance < 0 ? Vector3d(-axis) : axis;
}

Vector3d first_axis(const GuidePoints& guide, const std::vector<GuideSlice>& slices) {
  Mean base, apex;
  for (const GuidePoint& point : guide.points) {
    if (point.surface == GuideSurface::base) base.add(point.place_mm);
    if (is_apex(point.surface)) apex.add(point.place_mm);
  }
  if (base.count == 0) {
    const Vector3d axis = axis_of_stack(guide, slices);
    Mean all;
    for (const GuidePoint& point : guide.points)
      all.add(point.place_mm);
    return apex.count > 0 && axis.dot(apex.value() - all.value()) > 0 ? Vector3d(-axis) : axis;
  }
  if (apex.count > 0) return (base.value() - apex.value()).normalized();
  // The farthest points from the base are about the apex: their mean, of a twentieth.
  std::vector<std::pair<double, Vector3d>> by_distance;
  for (const GuidePoint& point : guide.points)
    if (point.surface != GuideSurface::base)
      by_distance.emplace_back(-(point.place_mm - base.value()).norm(), point.place_mm);
  std::sort(by_distance.begin(), by_distance.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  for (size_t i = 0; i < std::max<size_t>(1, by_distance.size() / 20); ++i)
    apex.add(by_distance[i].second);
  return (base.value() - apex.value()).normalized();
}

Eigen::Matrix3d axes_about(const Vector3d& axis) {
  // x lies towards the patient's left where the axis leaves it a choice.
  const Vector3d across = std::abs(axis.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  Eigen::Matrix3d axes;
  axes.col(2) = axis;
  axes.col(0) = (across - across.dot(axis) * axis).normalized();
  axes.col(1) = axis.cross(axes.col(0));
  return axes;
}

/// x^2 + y^2 = alpha_s + beta_s z + gamma_s z^2 + delta x + epsilon y + zeta x z + eta y z, s the wall: two ellipsoids of
/// revolution about a line that is near the axis.
Eigen::VectorXd fitted_quadrics(const GuidePoints& guide, const ProlateFrame& frame) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(10, 10);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(10);
  for (const GuidePoint& point : guide.points) {
    if (point.surface == GuideSurface::base) continue;
    const Vector3d x = frame.inside(point.place_mm);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(10);
    row.segment<3>(is_inner(point.surface) ? 0 : 3) << 1, x.z(), x.z() * x.z();
    row.tail<4>() << x.x(), x.y(), x.x() * x.z(), x.y() * x.z();
    normal += row * row.transpose();
    right += row * (x.x() * x.x() + x.y() * x.y());
  }
  return normal.completeOrthogonalDecomposition().solve(right);
}

}  // namespace

VentricleFrame ventricle_frame(const GuidePoints& guide, const std::vector<GuideSlice>& slices) {
  std::array<size_t, 2> count{};
  Mean all;
  for (const GuidePoint& point : guide.points) {
    all.add(point.place_mm);
    if (point.surface != GuideSurface::base) ++count[is_inner(point.surface) ? 0 : 1];
  }
  // Six numbers make an ellipsoid of revolution with its axis; twice that is the least that shows its errors.
  constexpr size_t least = 12;
  for (size_t wall = 0; wall < 2; ++wall) {
    if (count[wall] >= least) continue;
    throw InputError({guide.file, "",
                      fmt::format("has {} points of the {}, and {} is the least", count[wall],
                                  wall == 0 ? "endocardium" : "epicardium", least),
                      "Set points on both walls, in several slices from base to apex."});
  }
  VentricleFrame found;
  ProlateFrame& frame = found.frame;
  frame.origin_mm = all.value();
  frame.axes = axes_about(first_axis(guide, slices));
  Eigen::VectorXd q;
  for (int i = 0; i < 5; ++i) {
    q = fitted_quadrics(guide, frame);
    // The middle of the section at height z lies at (delta + zeta z, epsilon + eta z) / 2.
    const Vector3d axis = frame.axes * Vector3d(q[8] / 2, q[9] / 2, 1);
    frame.origin_mm = frame.patient({q[6] / 2, q[7] / 2, 0});
    frame.axes = axes_about(axis.normalized());
  }
  q = fitted_quadrics(guide, frame);
  double height = 0, focus_square = std::numeric_limits<double>::infinity();
  std::array<double, 2> long_axis{};
  for (size_t wall = 0; wall < 2; ++wall) {
    const Vector3d s = q.segment<3>(wall == 0 ? 0 : 3);
    if (!(s[2] < 0)) {
      throw InputError(
          {guide.file, "",
           fmt::format("the {} does not close towards an apex", wall == 0 ? "endocardium" : "epicardium"),
           "Set points down to the apex, in short-axis and long-axis slices."});
    }
    const double centre = -s[1] / (2 * s[2]);
    const double across_square = s[0] - s[2] * centre * centre;
    long_axis[wall] = std::sqrt(std::max(0.0, across_square / -s[2]));
    height += centre / 2;
    focus_square = std::min(focus_square, long_axis[wall] * long_axis[wall] - across_square);
  }
  frame.origin_mm = frame.patient({0, 0, height});
  // At a focus coordinates are singular: with the farther wall's the nearer one's apex would have no smooth lambda. Coordinates about a
  // sphere have no focus; with a third of the axis they do for one.
  frame.focus_mm = std::sqrt(std::max(focus_square, long_axis[0] * long_axis[0] / 9));
  const auto lambda = [&](double axis_mm) { return std::acosh(std::max(1.01, axis_mm / frame.focus_mm)); };
  found.inner_lambda = lambda(long_axis[0]);
  found.outer_lambda = lambda(long_axis[1]);
  return found;
}

}  // namespace diastole::imaging
