#pragma once
// From fitted sets of effects to a verdict, whatever they were fitted to.

#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// Within this of the best set's squares another set fits as well (3 sigma).
inline constexpr double as_good = 9.0;

/// A set of effects that was fitted to all data.
struct FittedEffects {
  std::vector<std::string> ids;  ///< sorted; empty: the base model
  double chi_square = 0.0;       ///< weighted
  size_t parameters = 0;
  inference::Termination termination = inference::Termination::converged;
};

/// An effect that was screened by the base model's residuals, fitted or not.
struct ScreenedEffect {
  std::string id;
  double gain = 0.0;        ///< of chi-square, by the score test
  double visibility = 0.0;  ///< in sigmas, at its typical size
  size_t parameters = 0;
};

/// What a search has seen.
struct SearchRecord {
  std::vector<FittedEffects> sets;  ///< the base model first
  size_t best = 0;                  ///< the set chosen
  std::vector<ScreenedEffect> screened;
};

struct Judgement {
  Verdict verdict = Verdict::none;
  std::vector<std::vector<std::string>> ambiguous_with;
  std::vector<SearchEnd> searches;  ///< that the verdict rests on
};

/// Evidence that is too weak to name anything and too strong to say "none" leaves all effects that could be meant beside
/// nothing at all: ambiguous, with no effect. `structure_left`: whether the chosen set's residuals are more than noise.
/// `gap`: how base and chosen set predict what they were not fitted to. Unexplained, and nothing is named: a set that
/// predicts it worse than the base model, one whose squares are no numbers, and one whose own search or the base model's did
/// not settle.
Judgement judge(const SearchRecord& search, bool structure_left, const Gap& gap);

/// The evidence table: what became of each set and of each effect that was only screened.
std::vector<Candidate> evidence(const SearchRecord& search, const Judgement& judgement);

/// A few sentences for people; with one for each search that did not settle.
std::string summary_of(const Explanation& found);

}  // namespace diastole::explain
