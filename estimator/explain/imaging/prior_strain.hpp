#pragma once
// How far a fit's prior values - readings of pressures, C1, the inner radius, tolerances - are from what all else says of them: by
// deleted residuals (estimator/inference/deleted_residual.hpp). A prior that is stated as surer than it
// is pulls the motion to itself and keeps a small residual; its deleted one shows it.

#include <Eigen/Dense>

#include "estimator/explain/imaging/field_fit.hpp"

namespace diastole::explain {

struct PriorStrain {
  double chi_square = 0.0;  ///< by which chi2 falls if all are left out
  double degrees = 0.0;     ///< combinations of them that the motion determines, too
  Eigen::VectorXd
      deleted;  ///< each one's residual if it alone is left out, in its own sds; 0 if it is the only source
  Eigen::VectorXd off;  ///< that in sds of it and of what the rest says, together
};
PriorStrain prior_strain(const FieldFit& fit);

}  // namespace diastole::explain
