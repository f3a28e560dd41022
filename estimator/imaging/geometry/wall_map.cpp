#include "estimator/imaging/geometry/wall_map.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "estimator/imaging/geometry/wall_harmonics.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

}  // namespace

WallMap::WallMap(const ProlateFrame& frame, const VentricleWalls& walls)
    : frame_(frame), walls_(walls), degree_(harmonic_degree(walls.middle.size() - 1)) {}

Prolate WallMap::at(double side, double theta, double mu) const {
  return {harmonics(degree_, mu, theta).value.dot(coefficients(side)), mu, theta};
}

double WallMap::base_mu(double side, double theta) const {
  const VectorXd c = coefficients(side);
  const auto above_base = [&](double mu) {
    const Vector3d x = frame_.place({harmonics(degree_, mu, theta).value.dot(c), mu, theta});
    return x.z() - walls_.base.dot(Vector3d(1, x.x(), x.y()));
  };
  // Regula falsi with the weight halved on the end that stays (Illinois), between a sixth of a turn from either pole.
  double low = std::numbers::pi / 6, high = std::numbers::pi * 5 / 6;
  double at_low = above_base(low), at_high = above_base(high);
  if (!(at_low < 0 && at_high > 0)) throw std::domain_error("the wall does not meet the base plane");
  int stayed = 0;
  for (int i = 0; i < 60 && high - low > 1e-12; ++i) {
    const double mu = (low * at_high - high * at_low) / (at_high - at_low);
    const double value = above_base(mu);
    if (std::abs(value) < 1e-11) return mu;
    if (value < 0) {
      low = mu;
      at_low = value;
      if (stayed == 1) at_high /= 2;
      stayed = 1;
    } else {
      high = mu;
      at_high = value;
      if (stayed == 2) at_low /= 2;
      stayed = 2;
    }
  }
  return 0.5 * (low + high);
}

double WallMap::distance_mm(double side, const Vector3d& inside_mm) const {
  Prolate p = frame_.coordinates(inside_mm);
  p.mu = std::max(p.mu, 1e-6);
  const Harmonics basis = harmonics(degree_, p.mu, p.theta);
  const VectorXd c = coefficients(side);
  const double wall = basis.value.dot(c);
  const double scale = frame_.scale_mm({0.5 * (wall + p.lambda), p.mu, p.theta});
  const double around = basis.by_theta.dot(c) * scale / frame_.tangents({wall, p.mu, p.theta}).col(2).norm();
  const double along = basis.by_mu.dot(c);
  return scale * (p.lambda - wall) / std::sqrt(1 + along * along + around * around);
}

double WallMap::sigma_mm(double side, double theta, double mu) const {
  const VectorXd basis = harmonics(degree_, mu, theta).value;
  VectorXd both = VectorXd::Zero(walls_.covariance.rows());
  both.head(2 * basis.size()) << basis, side * basis;
  const double variance = both.dot(walls_.covariance * both);
  return std::sqrt(variance) * frame_.scale_mm(at(side, theta, mu));
}

double WallMap::thickness_mm(double theta, double s) const {
  const double mu = s * base_mu(0, theta);
  const Vector3d across = place_mm(0.5, theta, mu) - place_mm(-0.5, theta, mu);
  const Prolate p{at(0, theta, mu)};
  const Harmonics basis = harmonics(degree_, mu, theta);
  const VectorXd c = coefficients(0);
  const Eigen::Matrix3d t = frame_.tangents(p);
  const Vector3d along = t.col(1) + basis.by_mu.dot(c) * t.col(0);
  const Vector3d around = t.col(2) + basis.by_theta.dot(c) * t.col(0);
  const Vector3d normal = along.cross(around).normalized();
  return std::abs(across.dot(normal));
}

double WallMap::cavity_sigma_mL() const {
  // dV = integral of d(lambda) h h h_theta over mu and theta, plus that of d(z) over the base: both in mm^3.
  constexpr int around = 48, along = 40;
  const Index count = walls_.middle.size();
  VectorXd by_all = VectorXd::Zero(2 * count + 3);
  const double step = 2 * std::numbers::pi / around;
  for (int i = 0; i < around; ++i) {
    const double theta = step * i;
    const double end = base_mu(-0.5, theta);
    for (int j = 0; j < along; ++j) {
      const double mu = end * (j + 0.5) / along;
      const Prolate p = at(-0.5, theta, mu);
      const double scale = frame_.scale_mm(p);
      const double volume =
          scale * scale * frame_.focus_mm * std::sinh(p.lambda) * std::sin(mu) * step * end / along;
      const VectorXd basis = harmonics(degree_, mu, theta).value;
      by_all.head(count) += volume * basis;
      by_all.segment(count, count) -= 0.5 * volume * basis;
    }
    const Vector3d rim = place_mm(-0.5, theta, end);
    const double radius = std::hypot(rim.x(), rim.y());
    by_all.tail<3>() +=
        step * radius * radius * Vector3d(0.5, radius * std::cos(theta) / 3, radius * std::sin(theta) / 3);
  }
  return 1e-3 * std::sqrt(by_all.dot(walls_.covariance * by_all));
}

}  // namespace diastole::imaging
