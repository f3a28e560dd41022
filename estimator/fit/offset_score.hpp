#pragma once
// Whether the data ask for a common offset of the frame pressures that the fit did not estimate.
//
// The offset's column joins the Jacobian at the estimate, and one Gauss-Newton step of all unknowns estimates what it
// would become (a score test: no equilibrium is solved). Its standard error is that of the joint problem, enlarged
// where the residuals spread more than stated.
//
// A frame 0 with a pressure other than exactly 0 was measured there and not set to zero: the undeformed body carries no
// load, so that this is a reading of the offset.

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "estimator/fit/joint_problem.hpp"

namespace diastole {

struct OffsetScore {
  double value_kPa;  ///< measured less true
  double se_kPa;
  std::vector<double> values;  ///< the values estimated with it, in their own units
};

/// The linear problem at the estimate: priors included, a robust loss as weights.
struct LinearProblem {
  const Eigen::MatrixXd& jacobian;
  const Eigen::VectorXd& residuals;
  const std::vector<bool>& is_free;
  double variance_factor;  ///< of the residuals about it
};

/// `column`: of the offset, in the rows of the linear problem (JointProblem::offset_column). Empty with fewer than two
/// loaded frames, and where the data do not see the offset.
std::optional<OffsetScore> offset_score(const JointProblem& problem, const Eigen::VectorXd& q,
                                        const LinearProblem& linear, const Eigen::VectorXd& column);

}  // namespace diastole
