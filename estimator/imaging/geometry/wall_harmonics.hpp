#pragma once
// Real spherical harmonics of (mu, theta): the smooth functions that make up a wall's lambda. They are smooth across the
// apex by themselves.
//
// Function number l^2 + l + m is Q_l^|m|(mu) times sqrt(2) sin(|m| theta) for m < 0, 1 for m = 0, sqrt(2) cos(m theta)
// for m > 0; Q is the associated Legendre function without the Condon-Shortley sign, of norm one over the sphere.

#include <Eigen/Dense>

namespace diastole::imaging {

constexpr Eigen::Index harmonic_count(int degree) {
  return static_cast<Eigen::Index>(degree + 1) * (degree + 1);
}
/// The degree l of function number k.
int harmonic_degree(Eigen::Index k);

struct Harmonics {
  Eigen::VectorXd value, by_mu, by_theta;
};

/// All functions up to a degree. Any mu, negative ones too.
Harmonics harmonics(int degree, double mu, double theta);

}  // namespace diastole::imaging
