// What laws say of each test, against closed forms, and its derivatives against differences, for every law.

#include <gtest/gtest.h>

#include <map>

#include "estimator/law_fit/test_kinds.hpp"
#include "tests/estimator/law_fit/closed_forms.hpp"

namespace diastole {
namespace {

using test::Mooney;

const TestKind& kind(std::string_view name) {
  for (const TestKind& each : test_kinds())
    if (each.name == name) return each;
  throw std::out_of_range(std::string(name));
}

Eigen::MatrixXd predicted(std::string_view law, const std::vector<double>& values, std::string_view test,
                          const std::vector<double>& controls, double fibre_rad = 0) {
  const LawAt at(*find_law(law), values, LawAt::Slopes::left_out);
  return kind(test).predict(at, controls, fibre_rad).value();
}

double near(double value) { return 1e-10 * (1 + std::abs(value)); }

TEST(TestKinds, MooneyAndRivlinsBody) {
  const Mooney body{6.1, 2.3};
  const auto check = [](double found, double expected) { EXPECT_NEAR(found, expected, near(expected)); };
  const auto of = [&](std::string_view test, const std::vector<double>& controls) {
    return predicted("mooney-rivlin", {body.C1_kPa, body.C2_kPa}, test, controls);
  };
  for (const double l : {0.7, 0.95, 1.0, 1.4, 2.5}) {
    check(of("uniaxial", {l})(0), body.uniaxial_kPa(l));
    check(of("planar", {l})(0), body.planar_kPa(l));
    for (const double l2 : {0.8, 1.0, 1.7}) {
      check(of("biaxial", {l, l2})(0), body.biaxial_kPa(l, l2));
      check(of("biaxial", {l, l2})(1), body.biaxial_kPa(l2, l));
    }
    for (const double turn_deg : {-80.0, 0.0, 25.0, 170.0}) {
      const double turn_rad_mm = turn_deg * std::numbers::pi / 180 / 21;
      check(of("torsion", {7, 21, l, turn_deg})(0), body.moment_Nmm(7, l, turn_rad_mm));
      check(of("torsion", {7, 21, l, turn_deg})(1), body.torsion_force_N(7, l, turn_rad_mm));
    }
    for (const double swelling : {0.97, 1.0, 1.3, 1.8}) {
      const double r_mm = 6 / std::sqrt(l) * swelling;
      check(of("tube", {4, 6, l, r_mm})(0), body.pressure_kPa(4, 6, l, r_mm));
      check(predicted("neo-hookean", {5.5}, "tube", {4, 6, l, r_mm})(1),
            Mooney{5.5, 0}.tube_force_N(4, 6, l, r_mm));
    }
  }
  for (const double k : {-0.4, 0.0, 1.2})
    check(of("simple-shear", {k})(0), body.shear_kPa(k));
}

/// Eq. 1 at the shear modulus 2 (C1 + C2), whatever the moment's sign.
TEST(TestKinds, RotationalShearIsEquationOne) {
  for (const double moment_Nmm : {-12.0, 40.0}) {
    const double C1_MPa = 8.71e-3, a_mm = 8, R_mm = 15, h_mm = 24;
    const double rotation_rad =
        moment_Nmm * (1 / (a_mm * a_mm) - 1 / (R_mm * R_mm)) / (8 * std::numbers::pi * h_mm * C1_MPa);
    const std::vector<double> controls{a_mm, 19, h_mm, moment_Nmm, R_mm};
    const double rotation_deg = rotation_rad * 180 / std::numbers::pi;
    EXPECT_NEAR(predicted("neo-hookean", {8.71}, "rotational-shear", controls)(0), rotation_deg,
                near(rotation_deg));
    EXPECT_NEAR(predicted("mooney-rivlin", {6.0, 2.71}, "rotational-shear", controls)(0), rotation_deg,
                near(rotation_deg));
  }
}

/// A stiffening law turns less than its modulus at rest says, and its torque is the same through every cylinder.
TEST(TestKinds, RotationalShearOfAStiffeningGel) {
  const double C1_kPa = 8, beta = 3, moment_Nmm = 100, a_mm = 8, R_mm = 15, h_mm = 24;
  // s(k) = 2 C1 exp(beta k^2) k, turned round by bisection; the trapezoidal rule in 1/r^2, in which the integrand is smooth.
  const auto shear = [&](double r_mm) {
    const double stress_kPa = 1e3 * moment_Nmm / (2 * std::numbers::pi * h_mm * r_mm * r_mm);
    double low = 0, high = 10;
    for (int i = 0; i < 80; ++i) {
      const double k = (low + high) / 2;
      (2 * C1_kPa * std::exp(beta * k * k) * k < stress_kPa ? low : high) = k;
    }
    return low;
  };
  constexpr int steps = 4000;
  double turn_rad = 0;
  for (int i = 0; i <= steps; ++i) {
    const double r_mm = a_mm + (R_mm - a_mm) * i / steps;
    turn_rad += (i == 0 || i == steps ? 0.5 : 1.0) * shear(r_mm) / r_mm * (R_mm - a_mm) / steps;
  }
  const double turn_deg = turn_rad * 180 / std::numbers::pi;
  EXPECT_NEAR(predicted("demiray", {C1_kPa, beta}, "rotational-shear", {a_mm, 19, h_mm, moment_Nmm, R_mm})(0),
              turn_deg, 1e-6 * turn_deg);
}

TEST(TestKinds, FibresAlongAndAcrossThePull) {
  const double C1 = 5, k1 = 4, l = 1.3;
  const std::vector<double> values{C1, 0, k1, 0};
  const double along_kPa = 2 * C1 * (l - 1 / (l * l)) + 2 * k1 * (l * l - 1) * l;
  EXPECT_NEAR(predicted("fibre-reinforced", values, "uniaxial", {l}, 0)(0), along_kPa, near(along_kPa));
  // Across: C1 (l2^2 - l3^2) + k1 (l2^2 - 1) l2^2 = 0 with l3 = 1 / (l l2).
  double low = 0.5, high = 1;
  for (int i = 0; i < 80; ++i) {
    const double l2 = (low + high) / 2, l3 = 1 / (l * l2);
    (C1 * (l2 * l2 - l3 * l3) + k1 * (l2 * l2 - 1) * l2 * l2 < 0 ? low : high) = l2;
  }
  const double l3 = 1 / (l * low), across_kPa = 2 * C1 * (l - l3 * l3 / l);
  EXPECT_NEAR(predicted("fibre-reinforced", values, "uniaxial", {l}, std::numbers::pi / 2)(0), across_kPa,
              near(across_kPa));
}

/// Readings of each kind that every law bears.
const std::map<std::string_view, std::vector<double>> gentle{{"uniaxial", {1.06}},
                                                             {"planar", {1.05}},
                                                             {"biaxial", {1.05, 1.03}},
                                                             {"simple-shear", {0.1}},
                                                             {"torsion", {8, 20, 1.03, 10}},
                                                             {"tube", {4, 6, 1.04, 6.15}},
                                                             {"rotational-shear", {8, 19, 24, 5, 15}}};

TEST(TestKinds, SlopesAreDifferencesOfPredictionsForEveryLaw) {
  int tried = 0;
  for (const Law* law : all_laws()) {
    std::vector<double> values;
    for (const LawParameter& parameter : law->parameters())
      values.push_back(parameter.typical);
    for (const TestKind& each : test_kinds()) {
      if (law->needs_axes() && each.fibre_from.empty()) continue;
      const double fibre_rad = law->needs_axes() && each.name != "uniaxial" ? 0.4 : 0;
      const auto& controls = gentle.at(each.name);
      const auto with = each.predict(LawAt(*law, values, LawAt::Slopes::given), controls, fibre_rad);
      ASSERT_TRUE(with) << law->name() << " " << each.name;
      ASSERT_EQ(with->rows(), std::ssize(each.columns) - static_cast<Eigen::Index>(each.controls));
      for (size_t p = 0; p < values.size(); ++p) {
        const double step = 1e-4 * std::abs(values[p]);
        const auto moved = [&](double by) {
          std::vector<double> other = values;
          other[p] += by;
          return each.predict(LawAt(*law, other, LawAt::Slopes::left_out), controls, fibre_rad).value();
        };
        const Eigen::VectorXd slope = (moved(step) - moved(-step)) / (2 * step);
        for (Eigen::Index row = 0; row < with->rows(); ++row) {
          const double scale = std::abs((*with)(row, 0) / values[p]);
          EXPECT_NEAR((*with)(row, static_cast<Eigen::Index>(p) + 1), slope[row], 2e-6 * scale)
              << law->name() << " " << each.name << " " << law->parameters()[p].name;
          ++tried;
        }
      }
    }
  }
  EXPECT_GT(tried, 200);
}

}  // namespace
}  // namespace diastole
