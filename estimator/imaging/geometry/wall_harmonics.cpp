#include "estimator/imaging/geometry/wall_harmonics.hpp"

#include <cmath>
#include <numbers>

namespace diastole::imaging {

int harmonic_degree(Eigen::Index k) {
  int degree = 0;
  while (harmonic_count(degree) <= k)
    ++degree;
  return degree;
}

Harmonics harmonics(int degree, double mu, double theta) {
  const double c = std::cos(mu), s = std::sin(mu);
  // Q(l, m), by the stable recurrence upwards in l.
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(degree + 1, degree + 2);
  q(0, 0) = std::sqrt(1 / (4 * std::numbers::pi));
  for (int m = 1; m <= degree; ++m)
    q(m, m) = q(m - 1, m - 1) * s * std::sqrt((2.0 * m + 1) / (2.0 * m));
  for (int m = 0; m < degree; ++m) {
    q(m + 1, m) = c * std::sqrt(2.0 * m + 3) * q(m, m);
    for (int l = m + 2; l <= degree; ++l) {
      const double factor = std::sqrt((4.0 * l * l - 1) / (l * l - m * m));
      const double before = std::sqrt(((l - 1.0) * (l - 1.0) - m * m) / (4.0 * (l - 1.0) * (l - 1.0) - 1));
      q(l, m) = factor * (c * q(l - 1, m) - before * q(l - 2, m));
    }
  }
  Harmonics all{Eigen::VectorXd(harmonic_count(degree)), Eigen::VectorXd(harmonic_count(degree)),
                Eigen::VectorXd(harmonic_count(degree))};
  for (int l = 0; l <= degree; ++l) {
    const Eigen::Index centre = static_cast<Eigen::Index>(l) * l + l;
    all.value[centre] = q(l, 0);
    all.by_mu[centre] = l == 0 ? 0.0 : -std::sqrt(l * (l + 1.0)) * q(l, 1);
    all.by_theta[centre] = 0;
    for (int m = 1; m <= l; ++m) {
      const double slope = 0.5 * (std::sqrt((l + m) * (l - m + 1.0)) * q(l, m - 1) -
                                  std::sqrt((l - m) * (l + m + 1.0)) * q(l, m + 1));
      const double cosine = std::numbers::sqrt2 * std::cos(m * theta);
      const double sine = std::numbers::sqrt2 * std::sin(m * theta);
      all.value[centre + m] = q(l, m) * cosine;
      all.value[centre - m] = q(l, m) * sine;
      all.by_mu[centre + m] = slope * cosine;
      all.by_mu[centre - m] = slope * sine;
      all.by_theta[centre + m] = -m * q(l, m) * sine;
      all.by_theta[centre - m] = m * q(l, m) * cosine;
    }
  }
  return all;
}

}  // namespace diastole::imaging
