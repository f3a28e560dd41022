#pragma once
// Imaged motion of a specimen that the model itself has made.

#include <array>

#include "estimator/explain/imaging/field_fit.hpp"

namespace diastole::explain {

inline constexpr std::array<size_t, 3> small_mesh{4, 3, 1};

struct SimulatedField {
  FieldModel truth;
  double C1_kPa = 8.0;
  std::vector<double> pressures_kPa{1.5, 3.0};
  double sigma_mm = 0.02;
  size_t points = 400;  ///< a frame
  unsigned seed = 1;
};

/// A case whose base is the paper's gel, C1 free; full points with noise, exact pressures of 0.005 kPa.
FieldCase simulated_case(const SimulatedField& field);

}  // namespace diastole::explain
