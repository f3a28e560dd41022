#pragma once
// What a finished search says of its unknowns: values, errors, the motion of each frame.

#include "estimator/fit/fit.hpp"

namespace diastole {

/// Of the data alone, at q. Precondition: `residuals(q)` succeeds.
QuadraticModel quadratic_model(JointProblem& problem, const Eigen::VectorXd& q);

/// The unknowns at q with each smooth region averaged over what the evidence says of its step, instead of those at
/// the most probable step alone; q where all steps are given. Precondition: `residuals(q)` succeeds.
Eigen::VectorXd mean_over_steps(JointProblem& problem, const Eigen::VectorXd& q, const FitOptions& options);

/// Fills values, frames, covariance, chi2 and what goes with them, at the optimum q. Returns the covariance in the
/// unknowns' own coordinates; empty (and the outcome's termination no_solution) if the model fails there.
Eigen::MatrixXd estimate_errors(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q,
                                const FitOptions& options);

}  // namespace diastole
