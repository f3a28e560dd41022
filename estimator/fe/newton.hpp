#pragma once
// Newton's method for the equilibrium at one cavity pressure, or at one cavity volume, damped by the natural monotonicity test
// (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 3.3, error-oriented):
//
//   K(x) d = -r(x)                     the tangent is factorised once an iteration
//   K(x) s = -r(x + f d)               the simplified correction judges the damping f: |s| <= (1 - f/4) |d|
//
// The test is in the space of displacements, so that it needs no weights between forces and volumes (the
// mixed problem is a saddle: neither energy nor residual has to fall). After an undamped step the factor is
// kept, and brought up to date by Broyden's updates (kept_factor.hpp), as long as the corrections shrink: each costs
// a twentieth of a new tangent. The size of a vector over the unknowns is
// sqrt( mean (dx / extent)^2 + mean (dp / p)^2 ).

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/solve_report.hpp"

namespace diastole {

struct NewtonResult {
  SolveReason reason = SolveReason::converged;
  ElasticState state;  ///< converged, or the last iterate
  std::vector<NewtonIteration> iterations;
  size_t factorisations = 0;
  size_t negative_pivots = 0;  ///< of the last tangent; not counted where the cavity's wall has a free rim
  std::optional<InvertedPlace> inverted;
  std::optional<size_t> beyond_law;  ///< an element
};

/// `guess` holds the load to solve for: pressure or held volume, tension, the chamber's sealing pressure. The factor of a
/// tangent near by is tried first, if there is one.
NewtonResult newton_solve(ElasticSystem& system, const ElasticState& guess, const SolveOptions& options,
                          std::shared_ptr<const CondensedFactor> near_by = {});

}  // namespace diastole
