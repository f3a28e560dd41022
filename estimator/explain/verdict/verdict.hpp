#pragma once
// From the fitted sets to a verdict.

#include <string>
#include <vector>

#include "estimator/explain/rig/residual_cells.hpp"
#include "estimator/explain/rig/search.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

struct Judgement {
  Verdict verdict = Verdict::none;
  std::vector<std::vector<std::string>> ambiguous_with;
  std::vector<ResidualCell> left;  ///< structure that remains after the chosen set
};

/// Evidence that is too weak to name anything and too strong to say "none" leaves all effects that could be meant beside
/// nothing at all: ambiguous, with no effect. `left`: cells of the chosen set's residuals that stand out (residual_cells.hpp).
/// `gap`: how base and chosen set predict what they were not fitted to. A set that predicts it worse than the base model
/// is not named, nor is one whose squares are no numbers: unexplained.
Judgement judge(const SearchResult& search, std::vector<ResidualCell> left, const Gap& gap);

/// Whether what remains is more than a known model leaves: one cell beyond chance so far that the number of cells
/// does not matter (Holm at 1e-6).
bool is_structured(const std::vector<ResidualCell>& left, size_t cells);

}  // namespace diastole::explain
