#pragma once
// The library's effects, each fitted to the imaged motion.

#include <string>
#include <vector>

#include "estimator/explain/imaging/field_fit.hpp"
#include "estimator/explain/imaging/inclusion_search.hpp"

namespace diastole::explain {

inline constexpr double worth_freeing =
    9.0;                                   ///< gain of chi2 by which further parameters of an effect must pay
inline constexpr double suspected = 1e-2;  ///< p-value of a linear gain: reason to fit the effect
inline constexpr double beyond_chance = 1e-3;        ///< of a place beside another effect
inline constexpr double effective_parameters = 5.0;  ///< of an inclusion: its sizes are tied to one another
inline constexpr size_t firsts = 2;                  ///< single effects that get partners

struct FieldHypothesis {
  std::vector<std::string> ids;  ///< of the effects
  FieldFit fit;
  double gain = 0.0;     ///< of chi2 over the base model on the same mesh
  double score = 0.0;    ///< explain_field.hpp
  double p_value = 1.0;  ///< corrected for the effects and places that were tried
  bool refitted = true;  ///< false: the gain is linear in the effect, and the fit the base's

  [[nodiscard]] std::string name() const;  ///< "end-bond-slip + strain-stiffening"
  [[nodiscard]] bool has_inclusion() const;
};

/// All effects that are the same all around the axis, on a mesh that is. Precondition: the solver stands at `base`.
std::vector<FieldHypothesis> fit_round_effects(FieldProblem& problem, const FieldFit& base);

/// An inclusion from the search's best guess; empty if that is not beyond chance. `base`: the problem's base fit. Its intervals are
/// only sought if its score comes near the one `to_beat`.
std::vector<FieldHypothesis> try_inclusion(const FieldProblem& problem, const FieldFit& base,
                                           const std::vector<InclusionGuess>& guesses, double to_beat);

// Two effects at once, tried where one alone does not do: each of the best single effects with every other one.

/// Joint fits, best first. `singles`, best first, and `lattice` are those of the same rows. A pair's score pays 2 log of the
/// number of pairs besides its parameters; its p-value is that of what it gains over the better of its single effects.
/// An inclusion beside another effect is searched in what that effect's own fit leaves.
std::vector<FieldHypothesis> fit_pairs(FieldProblem& problem, const FieldFit& base,
                                       const std::vector<FieldHypothesis>& singles,
                                       const InclusionLattice& lattice);

}  // namespace diastole::explain
