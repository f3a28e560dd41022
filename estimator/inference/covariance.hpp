#pragma once
// How uncertain the unknowns of a least-squares fit are, from the curvature of its cost: (J'J)^-1 of weighted residuals.
//
// The factorisation reveals the rank of J, its columns scaled to length one: combinations of unknowns that the data do
// not determine are named, the unknowns in them have an infinite variance and no covariances, and the others' are right.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "estimator/inference/parameter_space.hpp"

namespace diastole::inference {

struct Covariance {
  Eigen::MatrixXd matrix;  ///< rows and columns of unknowns that are not free are zero
  /// Changes of the coordinates that move no residual; the largest entry of each is 1.
  std::vector<Eigen::VectorXd> undetermined = {};
};

/// `is_free`: one entry an unknown; false for one on a bound or held.
Covariance estimate_covariance(const Eigen::MatrixXd& jacobian, const std::vector<bool>& is_free);
/// The same with all unknowns free.
Covariance estimate_covariance(const Eigen::MatrixXd& jacobian);

/// An undetermined combination in words: "ln C1 +1, ln C2 -0.5".
std::string in_words(const Eigen::VectorXd& combination, const ParameterSpace& space);

/// Covariance divided by the standard deviations; 0 where one of them is zero or infinite, 1 on the diagonal.
Eigen::MatrixXd correlation(const Eigen::MatrixXd& covariance);

/// How many unknowns the data determine rather than their priors: the trace of covariance times data information.
double effective_count(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& data_jacobian);

}  // namespace diastole::inference
