#pragma once
// The fit of an inclusion of another stiffness, on a mesh that is fine around it.
//
// What an inclusion adds to the motion at the highest pressure is that of equilibria with it (inclusion_body.hpp); in the other frames it
// is taken to grow as what a change of C1 does. C1 and the frames' pressures answer linearly, by the base fit's Jacobian. A full
// fit corrects this, at the best inclusion and by its slopes there, by what a finer mesh says, equilibria at three pressures, and tags
// followed through the whole motion (decision 0071).

#include "estimator/explain/imaging/field_fit.hpp"

namespace diastole::explain {

/// once: to a unit of chi2, without corrections. fully: to a tenth, from the guess and from a ball of a usual contrast at its
/// place, corrected, and wherever the profile of the contrast finds a deeper valley; with intervals (FieldFit::ci90) that carry
/// what the meshes leave: the guess should be what `once` has found.
enum class InclusionEffort { once, fully };

/// Best inclusion near the guess, beside the effects of `base`, whose parameters answer linearly too. `problem` is the one of the
/// base fit; chi2 and residuals compare with it. Without an equilibrium with one: no_solution.
FieldFit fit_inclusion(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess,
                       InclusionEffort effort);

/// The inclusion of a fit that has one.
Inclusion inclusion_of(const FieldFit& fit);

}  // namespace diastole::explain
