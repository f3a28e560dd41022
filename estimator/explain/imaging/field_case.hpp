#pragma once
// What a study says about its specimen and what was measured on it.
//
// A study whose bounds of C1 are within 5 % of its start states an independent test's result: they are its interval of
// two standard deviations (docs/decisions/0071-field-effects-against-rivals.md).

#include <array>
#include <functional>
#include <optional>

#include "estimator/effects/field_model.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole::explain {

struct Measured {
  double value = 0.0;
  double sigma = 0.0;
};

struct FieldCase {
  FieldModel base;
  LocatorOptions locator;
  Measurement measurement;
  Measured C1_start_kPa;  ///< sigma 0: free within the bounds
  std::array<double, 2> C1_bounds_kPa{};
  std::optional<Measured> inner_radius_mm;  ///< as frame 0 shows it
  int iteration_limit = 25;                 ///< of each fit
  std::function<void()> alive = {};  ///< called before each equilibrium of a fit; ends it by an exception

  void widen_sigmas(double factor) {
    for (TagPoint& tag : measurement.tags)
      tag.sigma_mm *= factor;
  }
};

/// Throws InputError for a study without imaged motion, of a stiffness that varies, or with frames that are not inflated. Precondition: gel
/// (is_gel, affected_model.hpp).
FieldCase field_case(const Study& study);

/// The radius at which frame 0's tags begin, taking it that they come as near to the inner wall as to the outer one.
std::optional<Measured> seen_inner_radius(const Measurement& measurement, double outer_radius_mm);

}  // namespace diastole::explain
