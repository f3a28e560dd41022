#pragma once
// A curve of a law as a smoothing spline: its values at knots are linear unknowns of a session's features, beside the
// nuisances (estimator/rig_fit/model_error.hpp).
//
// Before the data a curve is the Bayesian cubic smoothing spline (Wahba 1978): straight through nothing at rest, and an
// integrated Wiener process on each side of it,
//
//   cov f(x), f(y) = size^2 [ x y / X^2 + roughness k(x, y) ],   k = m^2 (3 M - m) / (2 X^3) on one side, 0 across,
//
// m and M the smaller and the larger distance from rest, X the largest. Size and roughness are where the evidence is
// largest, as are the shares of the model's error. A curve that must not fall with the distance, or not be negative, is made
// of increments that are positive or nothing (an active set): those that are nothing are no unknowns. That holds at the knots
// alone: between them the spline may bend the other way, as far as knots that close let it.

#include <Eigen/Dense>
#include <vector>

#include "estimator/explain/rig/port_law.hpp"
#include "estimator/rig_fit/model_error.hpp"

namespace diastole::explain {

/// Features about a point: target = responses * values + known * u + error.
struct LawProblem {
  Eigen::VectorXd target;
  Eigen::MatrixXd responses;  ///< by the curve's values at its knots but where it is nothing
  Eigen::MatrixXd known;      ///< by the other unknowns, each N(0, 1)

  /// These rows of it alone.
  [[nodiscard]] LawProblem rows(const std::vector<Eigen::Index>& rows) const;
};
rig::ModelError error_of_rows(const rig::ModelError& error, const std::vector<Eigen::Index>& rows);

/// What is known of a curve before the data.
class CurvePrior {
 public:
  CurvePrior(CurveShape shape, const std::vector<double>& knots, double scale);

  /// Of the knots, those at which the curve has a value to be found.
  [[nodiscard]] const std::vector<size_t>& free_knots() const { return free_; }
  [[nodiscard]] Eigen::MatrixXd covariance(double size, double roughness) const;
  /// Variance of the curve in the middle between two values that are known: what the knots do not hold.
  [[nodiscard]] double between_knots(double size, double roughness) const;
  /// Values by increments that are not negative; no columns: it may be any.
  [[nodiscard]] const Eigen::MatrixXd& increments() const { return increments_; }

  static constexpr std::array sizes{0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0};  ///< of the scale
  static constexpr std::array roughnesses{0.01, 0.1, 1.0, 10.0, 100.0};

 private:
  std::vector<size_t> free_;
  Eigen::MatrixXd straight_, rough_, increments_;
  double scale_, widest_ = 0.0;  ///< interval, over the farthest knot
};

struct LawFit {
  Eigen::VectorXd values;  ///< at the free knots
  Eigen::MatrixXd root;    ///< values = root * the evidence's first unknowns
  Eigen::VectorXd sd;      ///< of the values, whatever the shape
  rig::EvidenceFit evidence;
  size_t size = 4, roughness = 2;  ///< of the prior's lists

  [[nodiscard]] double size_value() const { return CurvePrior::sizes[size]; }
  [[nodiscard]] double roughness_value() const { return CurvePrior::roughnesses[roughness]; }
};
/// With size and roughness of the largest evidence about those of `near`.
LawFit fit_law(const LawProblem& problem, const rig::ModelError& error, const CurvePrior& prior,
               const LawFit& near);

}  // namespace diastole::explain
