#pragma once
// How alike the motion of neighbouring places and of successive phases is, learnt from the slice itself.
//
// Spline coefficients c (n places x T phases) have the prior  vec(c) ~ N(0, K_time (x) R^-1)  with R of SplinePlane::precision. The
// range of R and the T x T matrix K_time are those of the largest evidence (type-II maximum likelihood); K_time by expectation
// maximisation (Dempster, Laird, Rubin 1977). A body under one load moves along one curve, so K_time has few strong modes, and the late
// phases, whose tags have faded, lean on the early ones by as much as the data show.

#include <Eigen/Dense>
#include <vector>

#include "estimator/imaging/tracking/phase_information.hpp"

namespace diastole::imaging {

struct MotionPrior {
  double kappa_per_mm = 0;
  Eigen::MatrixXd place_precision;  ///< R
  Eigen::MatrixXd time_covariance;  ///< K_time, mm^2
  Eigen::MatrixXd modes;  ///< T x r: K_time is modes * modes^T but for what is smaller than `negligible_mm`
  Eigen::VectorXd left_out_mm;  ///< T: standard deviation of the motion that the modes leave out
};

/// `estimates`: n x T, found phase by phase.
MotionPrior learn_motion_prior(const SplinePlane& splines, const std::vector<PhaseInformation>& phases,
                               const Eigen::MatrixXd& estimates, const std::vector<double>& kappas_per_mm,
                               double negligible_mm);

}  // namespace diastole::imaging
