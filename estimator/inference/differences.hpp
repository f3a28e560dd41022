#pragma once
// Derivatives of residuals where a model has none of its own.

#include "estimator/inference/least_squares.hpp"

namespace diastole::inference {

/// By central differences of 1e-6 in each coordinate, which should be of order one. Precondition: the problem has a
/// solution there.
Eigen::MatrixXd central_differences(LeastSquaresProblem& problem, const Eigen::VectorXd& q);

}  // namespace diastole::inference
