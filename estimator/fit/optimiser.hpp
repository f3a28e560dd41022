#pragma once
// Levenberg-Marquardt with bounds (Ceres Solver's trust-region minimiser) on a joint problem, with the exact
// Jacobian. A trial point without equilibrium counts as a failed step: the trust region shrinks and the
// search goes on.

#include <functional>
#include <string>

#include "estimator/fit/joint_problem.hpp"

namespace diastole {

struct OptimiserStep {
  int iteration;
  double cost;
  bool accepted;
  Eigen::VectorXd q;  ///< the best unknowns so far
};

struct OptimiserOptions {
  int iteration_limit = 50;
  /// The search ends when the cost changes by less than this fraction in a step.
  double cost_tolerance = 1e-9;
  /// ... or when the unknowns do.
  double step_tolerance = 1e-8;
  std::function<void(const OptimiserStep&)> on_step;
};

struct OptimiserResult {
  Eigen::VectorXd q;
  bool converged;
  std::string reason;  ///< a sentence
  int iterations;      ///< steps tried
};

OptimiserResult minimise(JointProblem& problem, const Eigen::VectorXd& start,
                         const OptimiserOptions& options);

}  // namespace diastole
