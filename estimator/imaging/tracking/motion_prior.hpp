#pragma once
// How alike the motion of neighbouring places and of successive phases is, learnt from the slice itself.
//
// Spline coefficients c (n places x T phases) have the prior  vec(c) ~ N(0, K_time (x) R^-1)  with R of SplinePlane::precision. The
// range of R and the T x T matrix K_time are those of the largest evidence (type-II maximum likelihood); K_time by expectation
// maximisation (Dempster, Laird, Rubin 1977) until it settles, its variances then averaged over what their likelihoods leave. A body under one
// load moves along one curve, so K_time has few strong modes, and the late phases, whose tags have faded, lean on the early ones by
// as much as the data show.

#include <Eigen/Dense>
#include <vector>

#include "estimator/imaging/tracking/phase_information.hpp"

namespace diastole::imaging {

/// In the terms in which prior and images are nearly independent:  c = sum of V_i a_im U_m'  with a_im ~ N(0, 1).
struct MotionPrior {
  double kappa_per_mm = 0;
  Eigen::MatrixXd places;  ///< V, n x n: V V' = R^-1, and V' H V of the mean phase is diagonal
  Eigen::MatrixXd
      times;  ///< U, T x T, mm: U U' = K_time, and U' W U is diagonal with W how much each phase knows
};

/// `estimates`: n x T, near the truth; what the phases say is taken to be alike in the way it differs from them.
MotionPrior learn_motion_prior(const SplinePlane& splines, const std::vector<PhaseInformation>& phases,
                               const Eigen::MatrixXd& estimates, const std::vector<double>& kappas_per_mm);

}  // namespace diastole::imaging
