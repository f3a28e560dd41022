#pragma once
// What the model may err by, as a variance beside the noise's: numerics and constants of the base rig that nobody knows
// better, and a part of every change that an effect makes. Without it the many samples of a session would call a
// misfit of a hundredth of a sigma a discovery.
//
//   pressures at the cavity   1.5 Pa: hardly seen
//   pressures at the pump     15 Pa near its spikes
//   gated volumes             half of their sigma
//   an effect's own change    8 % of it at the pump, where neither recordings nor model resolve spikes better, 1 % in the
//                             cavity; of the largest change within 50 ms, since errors ring on
//
// All errors repeat from cycle to cycle, so that averaging cycles does not make them smaller.

#include <Eigen/Dense>

#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::explain {

struct ModelFloor {
  double cavity_kPa = 0.0015;
  double pump_kPa = 0.015;
  double volume_sigmas = 0.5;
  double part_of_change_pump = 0.08;
  double part_of_change_cavity = 0.01;
};

/// Variance of the model's error in each whitened residual; `change` is what the effects of the model changed there
/// (base residuals less the augmented), or empty.
Eigen::VectorXd model_variance(const rig::RigProblem& problem, const Eigen::VectorXd& change,
                               const ModelFloor& floor = {});

}  // namespace diastole::explain
