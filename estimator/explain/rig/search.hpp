#pragma once
// Which sets of effects explain the session: forward by screening and refits, with a beam so that a mixture that one
// effect imitates is still found; then backward, each effect against the set without it; then each against its
// look-alikes.

#include <functional>
#include <string>
#include <vector>

#include "estimator/explain/rig/screen.hpp"

namespace diastole::explain {

/// A set of effects, refitted.
struct FittedSet {
  rig::RigFit fit;
  double chi_square = 0.0;  ///< weighted

  [[nodiscard]] std::vector<std::string> ids() const;
  [[nodiscard]] size_t parameters() const;
};

/// What the search has seen. sets.front() is the base model.
struct SearchResult {
  std::vector<FittedSet> sets;
  std::vector<Lead> leads;  ///< by the base model's residuals, refitted or not
  size_t best = 0;          ///< the set chosen
};

struct SearchOptions {
  size_t most_effects = 3;
  size_t refitted = 4;  ///< of each screening
  size_t beam = 2;
  std::vector<rig::ModelTerm> start = {};  ///< effects that the model has already
  /// Ends once a set leaves less than this part of the base model's chi-square: what is small beside such effects is to be
  /// sought with the model's error of them and the noise without them.
  double enough = 0.0;
  Eigen::VectorXd change =
      {};  ///< of the residuals by effects that are known: the model errs by a part of it
  std::function<void(const std::string&)> progress;  ///< may throw to end the search
};

/// By how much weighted squares must fall for a set with `parameters` more to be taken: what chance reaches with a
/// probability of 1e-7 a candidate.
double admission(size_t parameters);

/// Whether a set is grown further beside the best one so far, by their reduced chi-squares: one that leaves four times as much
/// above the noise is not. The best itself always is.
bool worth_following(double reduced, double best);

/// Whether the best set plainly leaves misfit and has not found what most of it is: neither look-alikes nor a second search would
/// change that nothing can be named.
bool leaves_misfit(const FittedSet& base, const FittedSet& best);

/// What the square of each residual counts for: 1 / (1 + cycles x model variance), since the model's error repeats in
/// each of a segment's cycles while noise does not. `change` as in tolerance.hpp.
Eigen::VectorXd row_weights(const rig::Session& session, const rig::RigProblem& problem,
                            const Eigen::VectorXd& change);

SearchResult search(const rig::Session& session, const rig::SpecimenFamily& family,
                    const rig::RigProblem& problem, const SearchOptions& options);

}  // namespace diastole::explain
