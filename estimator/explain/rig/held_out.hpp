#pragma once
// How well a fitted model predicts what it was not fitted to.
//
// Runs are left out one after another. At a least-squares optimum the fit without the rows f is, to second order, one
// step d = (A - A_f)^-1 g_f away (A = J^T J, g_f = J_f^T r_f), so that no simulation is needed; its residuals at
// the rows are r_f + J_f d. Where that step is longer than some standard errors, the others are fitted anew. A run that alone determines an unknown cannot be predicted (lost steps happen once):
// it is left out in thirds of its cycles instead, and so is the only run of a session.

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::explain {

/// Rows that are left out together.
struct Fold {
  std::string name;  ///< the run's file
  size_t run = 0;
  std::vector<Eigen::Index> rows;
  std::vector<bool> others = {};  ///< the runs that remain; empty if only cycles are left out
};

/// One a run, or three a run whose rows alone determine an unknown of `fit`.
std::vector<Fold> folds_for(const rig::Session& session, const rig::RigProblem& problem,
                            const rig::RigFit& fit);

/// Squared weighted residuals at the folds' rows, each predicted without its fold.
double predicted_square(const rig::RigProblem& problem, const std::vector<Fold>& folds,
                        const rig::RigFit& fit, const Eigen::VectorXd& weights);

/// Reduced chi-squares before (base) and after (fit). The floor is half the mean square of successive cycles'
/// differences: what does not repeat, and no model can predict.
Gap held_out_gap(const rig::Session& session, const rig::RigProblem& problem, const rig::RigFit& fit,
                 const Eigen::VectorXd& weights);

}  // namespace diastole::explain
