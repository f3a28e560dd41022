#pragma once
// Covariances where not the Jacobian J is at hand but J'J, the information, with that of the priors.

#include "estimator/inference/covariance.hpp"

namespace diastole::inference {

/// As estimate_covariance, to half the digits: what J'J has lost of a combination to rounding is not determined.
Covariance covariance_of_information(const Eigen::MatrixXd& information);

/// What is known of unknowns of this covariance by themselves: zero for those of infinite variance.
Eigen::MatrixXd information_of_covariance(const Eigen::MatrixXd& covariance);

/// How far the residuals r stay from zero, in sigmas, once unknowns of which P is known beforehand adapt, r + K theta, to them:
///
///   d^2 = r'r - g' (K'K + P)^-1 g,   g = K'r
///
/// `gram` = [r K]' [r K]. Precondition: K'K + P is positive definite.
double separation(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& known);

}  // namespace diastole::inference
