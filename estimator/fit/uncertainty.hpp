#pragma once
// How uncertain the unknowns of a least-squares fit are, from the curvature of its cost.

#include <Eigen/Dense>
#include <vector>

namespace diastole {

/// Two-sided 95 % of the normal distribution, in standard deviations.
inline constexpr double normal_95 = 1.959963984540054;

/// (JᵀJ)⁻¹ of weighted residuals over the unknowns that are free; rows and columns of those that are not (on
/// a bound) are zero. An unknown that the data do not see at all gets an infinite variance.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const std::vector<bool>& is_free);

/// How many unknowns the data determine rather than their priors: the trace of covariance times data information.
double effective_count(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& data_jacobian);

/// Covariance divided by the standard deviations; 0 where one of them is zero or infinite, 1 on the diagonal.
Eigen::MatrixXd correlation(const Eigen::MatrixXd& covariance);

}  // namespace diastole
