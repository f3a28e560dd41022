#pragma once
// A periodic function through values with correlated errors: Gaussian-process regression on harmonics,
//
//   f(t) = c_0 + sum over k of a_k cos(2 pi k t / T) + b_k sin(2 pi k t / T),   a_k, b_k ~ N(0, s^2 k^(-2 m))
//
// whose size s and smoothness m maximise the evidence of the values. Between the values and beyond their bandwidth the error grows by what the prior leaves open. Integrals and
// derivatives are linear in the coefficients, so that their errors follow exactly.

#include <Eigen/Dense>

namespace diastole::imaging {

struct PeriodicRegression {
  double period_s = 0;
  double smoothness = 0;         ///< m
  Eigen::VectorXd coefficients;  ///< c_0, a_1, b_1, a_2, ...
  Eigen::MatrixXd covariance;

  /// Rows of the coefficients' functions: of the value at t, of the slope, of the integral from 0 to t.
  [[nodiscard]] Eigen::VectorXd value_row(double t) const;
  [[nodiscard]] Eigen::VectorXd slope_row(double t) const;
  [[nodiscard]] Eigen::VectorXd integral_row(double t) const;
  [[nodiscard]] double of(const Eigen::VectorXd& row) const { return row.dot(coefficients); }
  [[nodiscard]] double sigma_of(const Eigen::VectorXd& row) const;
};

/// Preconditions: as many times as values, all within one period of each other; a covariance that is positive definite.
PeriodicRegression periodic_regression(const Eigen::VectorXd& time_s, const Eigen::VectorXd& values,
                                       const Eigen::MatrixXd& covariance, double period_s);

/// The same curve, given that the mean over a period is zero: of all curves that the errors allow the likeliest that closes.
PeriodicRegression closed(const PeriodicRegression& curve);

}  // namespace diastole::imaging
