#pragma once
// Levenberg-Marquardt with bounds (Ceres Solver's trust-region minimiser) on a joint problem, with the exact
// Jacobian. A trial point without equilibrium counts as a failed step: the trust region shrinks and the
// search goes on. A search whose trust region has shrunk to nothing has small steps, too: it counts as converged only
// if the cost's quadratic model promises nothing any more, and has stalled otherwise.
//
// An unknown that rests on its bound while the cost falls only beyond it is held there for the next step: its
// column of the Jacobian is zero, so that the step is the others' own best one and not one that is spoilt when
// the bound cuts it off. Each accepted point decides anew by the sign of the gradient, the bound's multiplier
// (active set: D. P. Bertsekas, SIAM J. Control Optim. 20 (1982) 221).

#include <functional>
#include <optional>
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
  int iterations_before = 0;  ///< of earlier searches: they count towards the limit
  /// The search ends when the cost changes by less than this fraction in a step.
  double cost_tolerance = 1e-9;
  /// ... or when the unknowns do.
  double step_tolerance = 1e-8;
  std::optional<Eigen::Index> held;  ///< an unknown that keeps its start value
  std::function<void(const OptimiserStep&)> on_step;
  std::function<bool()> interrupted;  ///< asked after each step: true ends the search with the best so far
};

struct OptimiserResult {
  Eigen::VectorXd q;
  bool converged;
  std::string reason;    ///< a sentence
  int iterations;        ///< steps tried
  bool stalled = false;  ///< every step was refused although the cost has a slope
};

OptimiserResult minimise(JointProblem& problem, const Eigen::VectorXd& start,
                         const OptimiserOptions& options);

}  // namespace diastole
