#pragma once
// Which effects could lower the misfit: a score test of each at sizes worth finding.
//
// An effect's trial is one simulation of the session with the effect added to the current model. The change D of the
// whitened residuals r spans, with the changes by the effect's other parameters, what a small fit can reach; unknowns
// of the current model and the nuisances J are free beside it. The gain is what least squares over [J, D] takes off
// beyond J alone:
//
//   gain = |Q^T r|^2,  Q an orthonormal basis of D with J projected out
//
// An effect that begins at a change point has them scanned (estimator/rig_fit/change_point_search.hpp) and searched when it
// is tried; each counts as a parameter, and for the samples among which it was chosen.
//
// Finite sizes, because some effects show nothing near their neutral value (gas at the pump, a slow catheter). One that moves
// a resonance shows the truth's likeness only near the truth: it is tried at sizes up to its bound, and what counts of
// the large ones is the drop of squares itself, nothing extrapolated: gain = |r|^2 - |r + D - Q_J Q_J^T (r + D)|^2.

#include <Eigen/Dense>
#include <functional>
#include <optional>
#include <vector>

#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::explain {

struct Lead {
  rig::ModelTerm term;
  double gain = 0.0;        ///< of weighted squares; infinite gains do not exist: at most what is there
  double visibility = 0.0;  ///< of the effect at its typical size, in sigmas, the nuisances refitted
  size_t parameters = 0;
  std::optional<rig::RigFit> fit = {};  ///< made when an effect's change points were searched
};

/// Searches the change points of an effect that has them, of which `screen` only scanned. No gain is left if there are none.
void search_change_points(Lead& lead, const rig::RigProblem& problem, const rig::Session& session,
                          const rig::RigFit& current, const Eigen::VectorXd& weights);

/// What choosing a change point among a session's samples is worth in parameters.
inline constexpr size_t change_point_parameters = 3;

/// What least squares over `columns` takes off beyond `basis`; all rows times sqrt(weights).
double linear_gain(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns,
                   const Eigen::VectorXd& residuals);

/// All effects that fit the specimen and are not in `current` already, the largest gain first. `weights`: one a
/// residual, what a square counts for (search.hpp). `going_on` is asked before each effect, by any of the
/// problem's threads; it may throw.
std::vector<Lead> screen(const rig::RigProblem& problem, const rig::SpecimenFamily& family,
                         const rig::Session& session, const rig::RigFit& current,
                         const Eigen::VectorXd& weights, const std::function<void()>& going_on);

}  // namespace diastole::explain
