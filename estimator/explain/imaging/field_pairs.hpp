#pragma once
// Two effects at once, tried where one alone does not do: each of the best single effects with every other one.

#include <vector>

#include "estimator/explain/imaging/field_hypotheses.hpp"

namespace diastole::explain {

/// Joint fits, best first. `singles`, best first, and `lattice` are those of the same rows. A pair's score pays 2 log of the
/// number of pairs besides its parameters; its p-value is that of what it gains over the better of its single effects.
/// An inclusion beside another effect is searched in what that effect's own fit leaves.
std::vector<FieldHypothesis> fit_pairs(FieldProblem& problem, const FieldFit& base,
                                       const std::vector<FieldHypothesis>& singles,
                                       const InclusionLattice& lattice);

}  // namespace diastole::explain
