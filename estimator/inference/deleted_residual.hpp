#pragma once
// What all other data say of one measurement: its residual if the fit is made without it (Cook and Weisberg, Residuals and Influence in
// Regression, 1982, 2.2.1).

#include <Eigen/Dense>
#include <optional>

namespace diastole::inference {

struct DeletedResidual {
  double value;  ///< in the measurement's own sds, as its residual is
  double share;  ///< of the residual's variance that is left by the fit: 1 - leverage
};

/// `derivatives` of the residual by the unknowns, `inverse` of the normal matrix. None where only the measurement itself says it.
inline std::optional<DeletedResidual> deleted_residual(double residual, const Eigen::VectorXd& derivatives,
                                                       const Eigen::MatrixXd& inverse) {
  constexpr double determined_by_others = 1e-6;  // less is rounding
  const double share = 1.0 - derivatives.dot(inverse * derivatives);
  if (!(share > determined_by_others)) return std::nullopt;
  return DeletedResidual{residual / share, share};
}

}  // namespace diastole::inference
