#pragma once
// The declared rig with the effects that the study states: modulus and offsets fitted to a session's features, tolerances zero.

#include "estimator/rig_fit/session_problem.hpp"

namespace diastole::rig {

/// A model and what features and their derivatives by the nuisances are there.
struct LinearisedModel {
  SessionModel at;
  Eigen::VectorXd there;    ///< what it shows
  Eigen::MatrixXd columns;  ///< by u

  [[nodiscard]] Eigen::VectorXd misfit(const SessionProblem& problem) const {
    return problem.measured() - there;
  }
  /// What is to be explained by all of u.
  [[nodiscard]] Eigen::VectorXd target(const SessionProblem& problem) const {
    return misfit(problem) + columns * at.nuisances;
  }
};

/// The rig as declared, with effects that it is known to have, and the modulus and offsets that fit: where searches begin. Nothing rests on how
/// its own fits ended.
LinearisedModel declared_rig(const SessionProblem& problem, SessionModel with = {});

}  // namespace diastole::rig
