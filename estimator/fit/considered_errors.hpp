#pragma once
// Errors of what a fit takes as known – the fibres' directions, where the walls are – and what they do to the motion that it
// predicts. They are no unknowns: how far the estimate follows them is added to its covariance (fit_errors.cpp), as with the
// considered parameters of a Schmidt filter (A. H. Jazwinski, Stochastic Processes and Filtering Theory, 1970, 8.4).
//
// Each is an error that the whole body has alike, of standard deviation sigma:
//
//   fibres     the helix angle everywhere; the helix angle inside and, reversed, outside; the angle out of the wall   (degrees)
//   geometry   the inner wall along its normal; the outer wall along its normal, linear between them                  (mm)
//
// With r the residual of the equations, which depends on the amount m through axes or undeformed shape X, and dX/dm at held dofs,
//   K dx/dm = - dr/dm      dr/dm by central differences of the residual
//
// What the body has stored since rest changes as constrained_energy.hpp says.

#include <functional>
#include <string>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fit/motion_model.hpp"

namespace diastole {

struct ConsideredError {
  std::string source;  ///< "fibres", "geometry"
  double sigma;        ///< degrees, mm
  /// The model with this much of the error.
  std::function<ElasticModel(const ElasticModel& model, double amount)> with;
  NodeField shape;  ///< dX/d(amount); empty if the undeformed shape stays
};

/// Precondition: the model has material axes; ends are held, without springs or chamber.
std::vector<ConsideredError> fibre_errors(const ElasticModel& model, double sigma_deg);
std::vector<ConsideredError> geometry_errors(const ElasticModel& model, double sigma_mm);

/// What one standard deviation does to the motion at an equilibrium, whose tangent is factorised for it. Throws std::domain_error where it is
/// singular.
std::vector<ConsideredMotion> considered_motions(ElasticModel& model, const ElasticState& state,
                                                 const std::vector<ConsideredError>& errors);

}  // namespace diastole
