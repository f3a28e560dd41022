#pragma once
// Where a lump of another stiffness would explain most: the linear response of the elastic body to a small lump at each
// place of a lattice, against the base model's residuals. The response is that at the highest pressure, taken to be
// proportional to the pressure in the other frames.

#include <vector>

#include "estimator/explain/imaging/field_fit.hpp"

namespace diastole::explain {

struct InclusionGuess {
  Inclusion inclusion;
  double gain = 0.0;     ///< of chi2
  double p_value = 1.0;  ///< corrected for the number of places that can be told apart
};

/// How many lumps of a usual size the wall has room for: places that can be told apart.
double places_told_apart(const FieldModel& body);

/// Small lumps everywhere, and what each does to the motion.
struct LumpLattice {
  std::vector<Inclusion> places;
  Eigen::MatrixXd columns;  ///< over the problem's rows
};

/// Precondition: the problem's solver stands at `base`.
LumpLattice lump_lattice(FieldProblem& problem, const FieldFit& base);

/// The best stiffer and the best softer lump beside a fit, best first. `fit`: over the lattice's rows.
std::vector<InclusionGuess> search_inclusion(const LumpLattice& lattice, const FieldModel& body,
                                             const FieldFit& fit);

}  // namespace diastole::explain
