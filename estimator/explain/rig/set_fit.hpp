#pragma once
// The fit of one set of effects to a session's features, with its evidence.
//
// The effects' values and the modulus are searched; moments stay where event_scan.hpp put them, and their errors are in the covariance; offsets and tolerances follow as linear unknowns, by
// columns taken at a known model, or are searched too. Values and the shares of the model's error are found in turn, round by round, until
// the evidence rests (SetRound).

#include <limits>

#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {

/// A round: a search for the values at the shares of the one before, then one for the shares.
struct SetRound {
  inference::Termination values = inference::Termination::no_solution;
  bool crept = false;  ///< SearchResult::crept
  inference::Termination shares = inference::Termination::no_solution;
  double moved_nats = 0.0;  ///< by which it changed the evidence
  bool is_first = false;
  bool is_repeated = false;  ///< the next one goes on with better derivatives

  /// Whether the set's fit is at its end: the evidence moved by less than half a nat, which decides nothing, and the shares' search settled.
  [[nodiscard]] bool is_at_rest() const;
  /// How the set's fit ended if this was its last round: as the search for the values, but iteration_limit if that settled and the evidence
  /// does not rest, and **converged if it crept or ran into its limit of iterations and the evidence rests** - many steps that together
  /// bring less than decides anything; not in the first round, which is never at rest then.
  [[nodiscard]] inference::Termination termination() const;

 private:
  [[nodiscard]] bool has_no_end() const;
};

/// From `start`, with the columns of `known`. `best_so_far`: log posterior of the best set of all; one that is far from
/// it after a round is not searched further.
EffectSet fit_set(const rig::SessionProblem& problem, const rig::SessionModel& start,
                  const rig::LinearisedModel& known, const rig::Shares& shares,
                  double best_so_far = -std::numeric_limits<double>::infinity());

/// The same set again, with tolerances that are simulated: they need not be linear.
EffectSet fit_set_exactly(const rig::SessionProblem& problem, const EffectSet& near);

}  // namespace diastole::explain
