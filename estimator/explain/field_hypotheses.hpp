#pragma once
// The library's effects, each fitted to the imaged motion.

#include <string>
#include <vector>

#include "estimator/explain/field_fit.hpp"
#include "estimator/explain/inclusion_search.hpp"

namespace diastole::explain {

struct FieldHypothesis {
  std::string id;  ///< of the effect
  FieldFit fit;
  double gain = 0.0;     ///< of chi2 over the base model on the same mesh
  double score = 0.0;    ///< explain_field.hpp
  double p_value = 1.0;  ///< corrected for the effects and places that were tried
};

/// All effects that are the same all around the axis, on a mesh that is. Precondition: the solver stands at `base`.
std::vector<FieldHypothesis> fit_round_effects(FieldProblem& problem, const FieldFit& base);

/// A lump from the search's best guess; empty if that is not beyond chance. `base`: the problem's base fit.
std::vector<FieldHypothesis> fit_inclusion(const FieldProblem& problem, const FieldFit& base,
                                           const std::vector<InclusionGuess>& guesses);

}  // namespace diastole::explain
