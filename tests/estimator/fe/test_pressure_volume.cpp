// Pressure-volume curves by held volume: a thick neo-Hookean sphere over its pressure maximum against the closed form,
// and where pressure control has to give up.

#include <gtest/gtest.h>

#include "estimator/fe/pressure_volume.hpp"
#include "tests/estimator/fe/gel.hpp"
#include "tools/benchmarks/verification/sphere.hpp"

namespace diastole {
namespace {

constexpr HalfSphere sphere;

TEST(PressureVolume, OfASphereFollowsTheClosedFormOverItsMaximum) {
  ElasticModel model = sphere.model({8, 2, 1});
  const PressureVolumeCurve curve = pressure_volume_curve(model, {.volume_change_mL = 60.0, .steps = 10});
  ASSERT_TRUE(curve.last.converged()) << curve.last.describe();
  ASSERT_EQ(curve.points.size(), 11U);
  for (const PressureVolumePoint& point : curve.points) {
    EXPECT_NEAR(point.pressure_kPa, sphere.pressure_kPa(point.volume_change_mL), 2e-4);
    EXPECT_TRUE(point.stable_at_volume);
  }
  ASSERT_EQ(curve.limits.size(), 1U);
  double most_kPa = 0.0;
  double at_mL = 0.0;
  for (double volume_mL = 5.0; volume_mL < 60.0; volume_mL += 0.01) {
    if (sphere.pressure_kPa(volume_mL) <= most_kPa) continue;
    most_kPa = sphere.pressure_kPa(volume_mL);
    at_mL = volume_mL;
  }
  EXPECT_NEAR(curve.limits[0].pressure_kPa, most_kPa, 2e-4);
  EXPECT_NEAR(curve.limits[0].volume_change_mL, at_mL, 0.05);
  EXPECT_GT(curve.points.front().stiffness_kPa_per_mL, 0.0);
  EXPECT_LT(curve.points.back().stiffness_kPa_per_mL, 0.0);
  // The difference is that of the rule of integration: 4e-5 with 15 steps.
  EXPECT_NEAR(curve.work_mJ(), curve.points.back().stored_energy_mJ, 3e-4 * curve.work_mJ());
}

TEST(PressureVolume, PressureControlEndsAtTheMaximum) {
  ElasticModel model = sphere.model({8, 1, 1});
  const PressureVolumeCurve curve = pressure_volume_curve(model, {.volume_change_mL = 40.0, .steps = 5});
  ASSERT_EQ(curve.limits.size(), 1U);
  const double most_kPa = curve.limits[0].pressure_kPa;
  const Solution below = model.solve(0.98 * most_kPa);
  EXPECT_TRUE(below.report.converged());
  const Solution above = model.solve(1.02 * most_kPa);
  EXPECT_FALSE(above.report.converged());
  EXPECT_LT(above.report.reached_pressure_kPa, 1.005 * most_kPa);
  EXPECT_EQ(above.report.reason, SolveReason::limit_point);
  ASSERT_TRUE(above.report.pressure_limit);
  EXPECT_NEAR(above.report.pressure_limit->pressure_kPa, most_kPa, 0.005 * most_kPa);
  EXPECT_LT(above.report.pressure_limit->left, 0.1);
}

TEST(PressureVolume, CanBeStoppedAndEmptiesTheCavityToo) {
  ElasticModel model = gel(6.5, {5, 2, 1});
  size_t seen = 0;
  const PressureVolumeCurve curve = pressure_volume_curve(
      model, {.volume_change_mL = -20.0, .steps = 10, .on_point = [&](const auto&) { return ++seen < 4; }});
  EXPECT_EQ(curve.points.size(), 4U);
  EXPECT_DOUBLE_EQ(curve.points.back().volume_change_mL, -6.0);
  EXPECT_LT(curve.points.back().pressure_kPa, 0.0);
  EXPECT_TRUE(curve.limits.empty());
}

}  // namespace
}  // namespace diastole
