// Pressure-volume curves by held volume: a thick neo-Hookean sphere over its pressure maximum against the closed form,
// and where pressure control has to give up.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/fe/pressure_volume.hpp"
#include "tests/estimator/fe/gel.hpp"
#include "tests/estimator/fe/ventricle.hpp"

namespace diastole {
namespace {

constexpr double c1_kPa = 6.5;
constexpr double inner_mm = 20.0;
constexpr double outer_mm = 23.0;

/// Half a spherical shell on a frictionless plate.
ElasticModel half_sphere(std::array<size_t, 3> elements) {
  EllipsoidShape shape;
  shape.inner_axes_mm = {inner_mm, inner_mm};
  shape.outer_axes_mm = {outer_mm, outer_mm};
  shape.base_z_mm = 0.0;
  shape.base_grading = 0.0;
  shape.elements = elements;
  HermiteMesh mesh = make_ellipsoid(shape);
  HeldDofs held = hold_nothing(mesh);
  hold_face_component(mesh, mesh.faces().top, 2, held);
  // On the axes of symmetry, where nothing moves sideways.
  const size_t base = elements[0] * elements[1];
  held[dof_of(base, 0, 1)] = held[dof_of(base + elements[0] / 2, 0, 1)] =
      held[dof_of(base + elements[0] / 4, 0, 0)] = 1;
  return ElasticModel(std::move(mesh), *find_law("neo-hookean"), {.parameters = {c1_kPa}, .held = held});
}

/// P = 4 C1 [1/l + 1/(4 l^4)] taken from the inner to the outer wall, l = r/R: from W = C1 (2 l^2 + l^-4 - 3) and
/// P = integral of W'(l) / (l^3 - 1) dl.
double sphere_pressure_kPa(double half_volume_change_mL) {
  const double cubes_mm3 = 1e3 * half_volume_change_mL * 3.0 / (2.0 * std::numbers::pi);
  const auto term = [&](double radius_mm) {
    const double stretch = std::cbrt(std::pow(radius_mm, 3) + cubes_mm3) / radius_mm;
    return 1.0 / stretch + 0.25 / std::pow(stretch, 4);
  };
  return 4.0 * c1_kPa * (term(outer_mm) - term(inner_mm));
}

TEST(PressureVolume, OfASphereFollowsTheClosedFormOverItsMaximum) {
  ElasticModel model = half_sphere({8, 3, 1});
  const PressureVolumeCurve curve = pressure_volume_curve(model, {.volume_change_mL = 60.0, .steps = 15});
  ASSERT_TRUE(curve.last.converged()) << curve.last.describe();
  ASSERT_EQ(curve.points.size(), 16U);
  for (const PressureVolumePoint& point : curve.points) {
    EXPECT_NEAR(point.pressure_kPa, sphere_pressure_kPa(point.volume_change_mL), 2e-4);
    EXPECT_TRUE(point.stable_at_volume);
  }
  ASSERT_EQ(curve.limits.size(), 1U);
  double most_kPa = 0.0;
  double at_mL = 0.0;
  for (double volume_mL = 5.0; volume_mL < 60.0; volume_mL += 0.01) {
    if (sphere_pressure_kPa(volume_mL) <= most_kPa) continue;
    most_kPa = sphere_pressure_kPa(volume_mL);
    at_mL = volume_mL;
  }
  EXPECT_NEAR(curve.limits[0].pressure_kPa, most_kPa, 2e-4);
  EXPECT_NEAR(curve.limits[0].volume_change_mL, at_mL, 0.05);
  EXPECT_GT(curve.points.front().stiffness_kPa_per_mL, 0.0);
  EXPECT_LT(curve.points.back().stiffness_kPa_per_mL, 0.0);
  EXPECT_NEAR(curve.work_mJ(), curve.points.back().stored_energy_mJ, 1e-4 * curve.work_mJ());
}

TEST(PressureVolume, PressureControlEndsAtTheMaximum) {
  ElasticModel model = half_sphere({8, 2, 1});
  const PressureVolumeCurve curve = pressure_volume_curve(model, {.volume_change_mL = 40.0, .steps = 8});
  ASSERT_EQ(curve.limits.size(), 1U);
  const double most_kPa = curve.limits[0].pressure_kPa;
  const Solution below = model.solve(0.98 * most_kPa);
  EXPECT_TRUE(below.report.converged());
  const Solution above = model.solve(1.02 * most_kPa);
  EXPECT_FALSE(above.report.converged());
  EXPECT_LT(above.report.reached_pressure_kPa, 1.001 * most_kPa);
}

TEST(PressureVolume, CanBeStoppedAndEmptiesTheCavityToo) {
  ElasticModel model = gel(c1_kPa, {5, 2, 1});
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
