#pragma once
// A shear test of the paper's design: gel annulus 16 mm inner and 38 mm outer diameter, 24 mm high, 4 loads, 15
// markers, C1 = 8.71 kPa, normal noise of one standard deviation in every rotation.

#include <numbers>
#include <random>

#include "estimator/shear/shear_test.hpp"

namespace diastole::test {

inline constexpr double true_C1_kPa = 8.71;
inline constexpr Annulus paper_annulus = {8, 19, 24};

inline ShearTest synthetic_shear(double noise_deg, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  ShearTest test = {"synthetic.csv", "force_per_string_N", {}};
  for (const double force_per_string_N : {0.25, 0.5, 0.75, 1.0}) {
    for (int marker = 0; marker < 15; ++marker) {
      const double radius_mm = 8 + 11 * (marker + 0.5) / 15;
      // Eq. 1 as the paper prints it, F the force of each string, C1 in N/mm2.
      const double rotation_rad = force_per_string_N / (true_C1_kPa / 1000) * 19 *
                                  (1 / (8.0 * 8.0) - 1 / (radius_mm * radius_mm)) /
                                  (4 * std::numbers::pi * 24);
      test.rows.push_back({paper_annulus, 2 * force_per_string_N * 19, radius_mm,
                           rotation_rad + noise_deg * std::numbers::pi / 180 * normal(random),
                           test.rows.size() + 2});
    }
  }
  return test;
}

}  // namespace diastole::test
