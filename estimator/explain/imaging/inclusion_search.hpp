#pragma once
// Where an inclusion of another stiffness would explain most: the linear response of the elastic body to a small inclusion at each
// place of a lattice, against the base model's residuals. The response is that at the highest pressure, taken to be
// proportional to the pressure in the other frames.

#include <vector>

#include "estimator/explain/imaging/field_fit.hpp"

namespace diastole::explain {

struct InclusionGuess {
  Inclusion inclusion;
  double gain = 0.0;     ///< of chi2
  double p_value = 1.0;  ///< corrected for the number of distinguishable places
};

/// How many inclusions of a usual size a wall has room for: distinguishable places.
double distinct_places(double volume_mm3);
double wall_volume_mm3(const FieldModel& body);

/// Small inclusions everywhere, and what each does to the motion.
struct InclusionLattice {
  std::vector<Inclusion> places;
  Eigen::MatrixXd columns;  ///< over the problem's rows
};

/// Precondition: the problem's solver stands at `base`.
InclusionLattice inclusion_lattice(FieldProblem& problem, const FieldFit& base);
/// In any body, by its equilibrium at the highest pressure; `shares`: each slot's pressure over that.
InclusionLattice inclusion_lattice(const MotionResiduals& rows, ElasticModel& body, const ElasticState& state,
                                   const std::vector<double>& shares);

/// The best stiffer and the best softer inclusion beside a fit, best first. `fit`: over the lattice's rows.
std::vector<InclusionGuess> search_inclusion(const InclusionLattice& lattice, double volume_mm3,
                                             const FieldFit& fit);

}  // namespace diastole::explain
