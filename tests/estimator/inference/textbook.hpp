#pragma once
// Problems whose minima are known.

#include <cmath>
#include <functional>
#include <utility>

#include "estimator/inference/least_squares.hpp"

namespace diastole::inference {

/// Residuals by a function, which may have no solution; their derivatives by central differences.
class FunctionProblem : public LeastSquaresProblem {
 public:
  using Function = std::function<std::optional<Eigen::VectorXd>(const Eigen::VectorXd&)>;

  FunctionProblem(std::vector<Parameter> parameters, Function function,
                  Linearisation linearisation = Linearisation::fresh)
      : space_(std::move(parameters)), function_(std::move(function)), linearisation_(linearisation) {}

  [[nodiscard]] const ParameterSpace& space() const override { return space_; }
  [[nodiscard]] Linearisation linearisation() const override { return linearisation_; }
  std::optional<Eigen::VectorXd> residuals(const Eigen::VectorXd& q) override {
    ++calls;
    return function_(q);
  }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& q) override { return central_differences(*this, q); }
  [[nodiscard]] std::string failure() const override { return "there is nothing here"; }

  int calls = 0;  ///< of the function, those for derivatives included

 private:
  ParameterSpace space_;
  Function function_;
  Linearisation linearisation_;
};

/// H. H. Rosenbrock's valley, least at (1, 1).
inline std::optional<Eigen::VectorXd> rosenbrock(const Eigen::VectorXd& q) {
  return Eigen::Vector2d(10 * (q[1] - q[0] * q[0]), 1 - q[0]);
}

/// M. J. D. Powell's function, least at 0, where its Jacobian is singular.
inline std::optional<Eigen::VectorXd> powell(const Eigen::VectorXd& q) {
  return Eigen::Vector4d(q[0] + 10 * q[1], std::sqrt(5.0) * (q[2] - q[3]), std::pow(q[1] - 2 * q[2], 2),
                         std::sqrt(10.0) * std::pow(q[0] - q[3], 2));
}

/// Forty readings of a exp(-b t) + c, without errors, in standard deviations of 0.01, at values a, b, c.
inline FunctionProblem::Function decay(const Eigen::Vector3d& truth) {
  return [truth](const Eigen::VectorXd& q) -> std::optional<Eigen::VectorXd> {
    Eigen::VectorXd r(40);
    for (Eigen::Index k = 0; k < r.size(); ++k) {
      const double t = 0.1 * static_cast<double>(k);
      const double misfit = q[0] * std::exp(-q[1] * t) + q[2] - truth[0] * std::exp(-truth[1] * t) - truth[2];
      r[k] = misfit / 0.01;
    }
    return r;
  };
}

}  // namespace diastole::inference
