#pragma once
// Where a lump of another stiffness would explain most: the linear response of the elastic body to a small lump at each
// place of a lattice, against the base model's residuals. The response is that at the highest pressure, taken to be
// proportional to the pressure in the other frames.

#include <vector>

#include "estimator/explain/field_fit.hpp"

namespace diastole::explain {

struct InclusionGuess {
  Inclusion inclusion;
  double gain = 0.0;     ///< of chi2
  double p_value = 1.0;  ///< corrected for the number of places that can be told apart
};

/// How many lumps of a usual size the wall has room for: places that can be told apart.
double places_told_apart(const FieldModel& body);

/// The best stiffer and the best softer lump, best first. Precondition: the problem's solver stands at `base`.
std::vector<InclusionGuess> search_inclusion(FieldProblem& problem, const FieldFit& base);

}  // namespace diastole::explain
