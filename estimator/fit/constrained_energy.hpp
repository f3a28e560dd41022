#pragma once
// What a body has stored, in the form whose derivatives are simple.
//
//   L = integral of W - integral of p (J - 1)
//
// Where the constraint holds, L is the stored energy. With m a parameter or the undeformed shape, dL/dm at an equilibrium is its
// derivative at held unknowns x, p and, along dx/dm, what the cavity's pressure does: p takes no part, and the constraint's own dependence
// on m is in it.

#include "estimator/fe/elastic_model.hpp"

namespace diastole {

/// Less the same of the model's state at rest, mJ. Precondition: no springs, no chamber.
double constrained_energy_mJ(const ElasticModel& model, const ElasticState& state);

/// What the cavity's pressure does along a change of the positions, mJ.
double pressure_work_mJ(const ElasticModel& model, const ElasticState& state, const NodeField& change_mm);

}  // namespace diastole
