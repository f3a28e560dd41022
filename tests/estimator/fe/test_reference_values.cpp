// The converged displacements and cavity volumes of the gel phantom (two axisymmetric discretisations and a
// third code agree on them in the fourth to fifth digit).

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "estimator/mesh/point_locator.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

struct ReferenceCase {
  double pressure_kPa;
  double c1_kPa;
  std::array<double, 5> radial_mm;  ///< at R = 22.5, 30, 36.25, 43, 50 mm, mid-height
  double volume_change_mL;
};

constexpr std::array<double, 5> radii_mm{22.5, 30.0, 36.25, 43.0, 50.0};
constexpr std::array<ReferenceCase, 3> reference_cases{
    {{6.0, 6.5, {8.0557, 6.6906, 5.8081, 4.9988, 4.2197}, 78.351},
     {3.1, 8.8, {2.6145, 2.1351, 1.8454, 1.5863, 1.3370}, 23.883},
     {2.0, 4.0, {3.8584, 3.1649, 2.7384, 2.3545, 1.9851}, 35.761}}};

class ReferenceValues : public testing::TestWithParam<ReferenceCase> {
 protected:
  static void expect_within(std::array<size_t, 3> elements, double tolerance) {
    const ReferenceCase& expected = GetParam();
    ElasticModel model = gel(expected.c1_kPa, elements);
    const Solution solution = model.solve(expected.pressure_kPa);
    ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
    EXPECT_EQ(solution.report.negative_pivots, model.pressure_dofs());
    const double change_mL =
        model.cavity_volume_mL(solution.state) - model.cavity_volume_mL(model.rest_state());
    EXPECT_NEAR(change_mL / expected.volume_change_mL, 1.0, tolerance);
    const PointLocator locator(model.mesh(), model.mesh().reference());
    for (const double angle : {0.0, 0.3, 4.0}) {
      for (size_t i = 0; i < radii_mm.size(); ++i) {
        const auto found = locator.find({radii_mm[i] * std::cos(angle), radii_mm[i] * std::sin(angle), 0.0});
        ASSERT_TRUE(found);
        const double radius = model.mesh().value(solution.state.position_mm, found->point).head<2>().norm();
        EXPECT_NEAR((radius - radii_mm[i]) / expected.radial_mm[i], 1.0, tolerance) << "R = " << radii_mm[i];
      }
    }
  }
};

TEST_P(ReferenceValues, WithinOnePercentOnThePapersMesh) { expect_within({8, 4, 1}, 0.01); }

TEST_P(ReferenceValues, WithinFifteenHundredthsOfAPercentOnTheFineMesh) { expect_within({8, 8, 4}, 0.0015); }

INSTANTIATE_TEST_SUITE_P(GelPhantom, ReferenceValues, testing::ValuesIn(reference_cases),
                         [](const auto& listed) { return "load" + std::to_string(listed.index + 1); });

}  // namespace
}  // namespace diastole
