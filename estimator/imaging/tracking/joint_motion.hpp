#pragma once
// The motion of all phases at once: a Gaussian prior (motion_prior.hpp) and what the images of every phase say.

#include <Eigen/Dense>
#include <vector>

#include "estimator/imaging/tracking/motion_prior.hpp"

namespace diastole::imaging {

/// Of the coefficients of all phases.
struct JointCovariance {
  struct Term {
    Eigen::Index place, time;
  };

  MotionPrior prior;
  std::vector<Term> terms;  ///< V_i a_im U_m' that are solved for; all others keep the prior's variance
  Eigen::MatrixXd
      inverse_factor;  ///< of the terms' precision, lower triangle: their covariance is its transpose times it

  /// F of the covariance F' F of a phase's n coefficients; mm.
  [[nodiscard]] Eigen::MatrixXd phase_factor(size_t phase) const;
};

struct JointMotion {
  Eigen::MatrixXd coefficients;  ///< n x T, mm
  JointCovariance covariance;    ///< empty if it is not asked for
};

JointMotion fit_jointly(const MotionPrior& prior, const std::vector<PhaseInformation>& phases,
                        bool with_covariance);

}  // namespace diastole::imaging
