#pragma once
// Bench tests of a Mooney-Rivlin body as files, from the closed forms.

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "estimator/law_fit/bench_test.hpp"
#include "tests/estimator/law_fit/closed_forms.hpp"

namespace diastole::test {

inline constexpr Mooney gel{6.0, 2.0};

class MadeTests {
 public:
  /// Normal noise of so large a part of what is measured.
  explicit MadeTests(double noise = 0, unsigned seed = 1) : noise_(noise), random_(seed) {}

  BenchTest uniaxial(const Mooney& body = gel) {
    std::string text = "stretch,nominal_kPa\n";
    for (int i = 1; i <= 20; ++i)
      text += fmt::format("{},{}\n", stretch(i), noisy(body.uniaxial_kPa(stretch(i))));
    return bench_test_from_text(text, "uniaxial.csv");
  }
  BenchTest planar(const Mooney& body = gel) {
    std::string text = "planar_stretch,nominal_kPa\n";
    for (int i = 1; i <= 20; ++i)
      text += fmt::format("{},{}\n", stretch(i), noisy(body.planar_kPa(stretch(i))));
    return bench_test_from_text(text, "planar.csv");
  }
  BenchTest equibiaxial(const Mooney& body = gel) {
    std::string text = "stretch_1,stretch_2,nominal_1_kPa,nominal_2_kPa\n";
    for (int i = 1; i <= 20; ++i) {
      const double l = stretch(i), first = noisy(body.biaxial_kPa(l, l)),
                   second = noisy(body.biaxial_kPa(l, l));
      text += fmt::format("{},{},{},{}\n", l, l, first, second);
    }
    return bench_test_from_text(text, "equibiaxial.csv");
  }
  BenchTest simple_shear(const Mooney& body = gel) {
    std::string text = "shear,shear_stress_kPa\n";
    for (int i = 1; i <= 20; ++i)
      text += fmt::format("{},{}\n", 0.04 * i, noisy(body.shear_kPa(0.04 * i)));
    return bench_test_from_text(text, "simple-shear.csv");
  }
  BenchTest torsion(const Mooney& body = gel) {
    std::string text =
        "cylinder_radius_mm,cylinder_height_mm,axial_stretch,twist_deg,moment_Nmm,axial_force_N\n";
    for (const double l : {1.0, 1.2}) {
      for (int i = 1; i <= 10; ++i) {
        const double turn_rad_mm = 10.0 * i * std::numbers::pi / 180 / 20;
        text += fmt::format("8,20,{},{},{},{}\n", l, 10 * i, noisy(body.moment_Nmm(8, l, turn_rad_mm)),
                            noisy(body.torsion_force_N(8, l, turn_rad_mm)));
      }
    }
    return bench_test_from_text(text, "torsion.csv");
  }
  BenchTest tube(const Mooney& body = gel) {
    std::string text =
        "unloaded_inner_radius_mm,unloaded_outer_radius_mm,axial_stretch,outer_radius_mm,pressure_kPa\n";
    for (const double l : {1.0, 1.3}) {
      for (int i = 1; i <= 10; ++i) {
        const double r_mm = 6 / std::sqrt(l) * (1 + 0.04 * i);
        text += fmt::format("4,6,{},{},{}\n", l, r_mm, noisy(body.pressure_kPa(4, 6, l, r_mm)));
      }
    }
    return bench_test_from_text(text, "tube.csv");
  }

 private:
  static double stretch(int i) { return 1 + 0.05 * i; }
  double noisy(double value) { return value * (1 + noise_ * normal_(random_)); }

  double noise_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_{0, 1};
};

}  // namespace diastole::test
