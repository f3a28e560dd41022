#pragma once
// The Lagrange pressure for stresses that are shown.
//
// An element's own pressure carries, along each direction, a weakly controlled sawtooth: one linear function repeated in
// all elements, which the volume of a C1 displacement hardly sees (docs/verification.md, orders of convergence). At a
// node where elements meet, the mean of their values is free of it, and converges with order 2. The mean is taken over
// elements of the same parameters only: where the material changes, its pressure jumps.

#include "estimator/fe/elastic_state.hpp"

namespace diastole {

class ElasticSystem;

/// `state` with each corner's pressure replaced by that mean; no equilibrium of the discrete equations, but what
/// point_fields() and all that is drawn from it should be given.
ElasticState with_averaged_pressure(const ElasticSystem& system, const ElasticState& state);

}  // namespace diastole
