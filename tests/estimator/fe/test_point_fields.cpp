// Stress and strain at points: against the thick-walled cylinder's closed form, the traction on its faces, and
// the balance of forces across a cut (Laplace's law).

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/fe/point_fields.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

constexpr double inner_mm = 22.5;
constexpr double outer_mm = 50.0;
constexpr double tube_c1_kPa = 6.5;

/// An infinitely long neo-Hookean cylinder whose inner radius has grown to a: R^2 = r^2 - c.
struct Cylinder {
  double a_mm;
  double c = a_mm * a_mm - inner_mm * inner_mm;
  double b_mm = std::sqrt(outer_mm * outer_mm + c);

  [[nodiscard]] double radial_kPa(double r) const {
    const double reference = std::sqrt(r * r - c);
    return -2.0 * tube_c1_kPa *
           (std::log(outer_mm * r / (reference * b_mm)) + 0.5 * c * (1.0 / (r * r) - 1.0 / (b_mm * b_mm)));
  }
  [[nodiscard]] double hoop_kPa(double r) const {
    const double stretch2 = r * r / (r * r - c);
    return radial_kPa(r) + 2.0 * tube_c1_kPa * (stretch2 - 1.0 / stretch2);
  }
};

TEST(PointFields, OfACylinderFollowTheClosedForm) {
  const Cylinder exact{28.0};
  const double pressure_kPa = -exact.radial_kPa(exact.a_mm);
  constexpr size_t layers = 4;
  ElasticModel model = plane_strain_slice(tube_c1_kPa, layers);
  const Solution solution = model.solve(pressure_kPa);
  ASSERT_TRUE(solution.report.converged());
  double hoop_force = 0.0;  // integral of sigma_cc dr
  for (size_t layer = 0; layer < layers; ++layer) {
    for (size_t q = 0; q < 4; ++q) {
      const double xi3 = line_rule_4().place[q];
      const MaterialPoint point{8 * layer, {0.3, 0.4, xi3}};
      const PointFields fields = point_fields(model.system(), solution.state, point);
      const Eigen::Vector3d place = fields.reference_mm + fields.displacement_mm;
      const double r = place.head<2>().norm();
      const SymmetricTensor<double> stress = along(fields.wall.deformed, fields.stress_kPa);
      EXPECT_NEAR(stress[0], exact.hoop_kPa(r), 0.02 * pressure_kPa) << r;
      EXPECT_NEAR(stress[2], exact.radial_kPa(r), 0.02 * pressure_kPa) << r;
      EXPECT_NEAR(stress[3], 0.0, 1e-2 * pressure_kPa) << r;
      const double stretch = r / std::sqrt(r * r - exact.c);
      const SymmetricTensor<double> strain = along(fields.wall.reference, fields.green_strain);
      EXPECT_NEAR(strain[0], 0.5 * (stretch * stretch - 1.0), 2e-3);
      EXPECT_NEAR(strain[2], 0.5 * (1.0 / (stretch * stretch) - 1.0), 2e-3);
      EXPECT_NEAR(stretch_along_first(fields, fields.wall), stretch, 2e-3);
      EXPECT_NEAR(fields.volume_ratio, 1.0, 2e-3);
      const double dr = model.mesh().xi_gradient(solution.state.position_mm, point).col(2).norm();
      hoop_force += line_rule_4().weight[q] * stress[0] * dr;
    }
  }
  EXPECT_NEAR(hoop_force, pressure_kPa * exact.a_mm, 0.002 * hoop_force);
}

TEST(PointFields, OfAnInclusionAtRestHaveNoStress) {
  ElasticModel model = gel(6.5, {5, 3, 2}, {.stiffness = inclusion(4.0)});
  double stiffest = 1.0;
  for (size_t element = 0; element < model.mesh().element_count(); ++element)
    for (const double xi1 : {0.1, 0.5, 0.9})
      for (const double xi2 : {0.1, 0.5, 0.9})
        for (const double xi3 : {0.1, 0.5, 0.9}) {
          const PointFields fields =
              point_fields(model.system(), model.rest_state(), {element, {xi1, xi2, xi3}});
          stiffest = std::max(stiffest, model.system().stiffness()(fields.reference_mm));
          EXPECT_LT(fields.stress_kPa.norm(), 1e-10);
        }
  EXPECT_GT(stiffest, 2.0);
}

TEST(PointFields, CarryThePressureToTheWallsAsTraction) {
  constexpr double pressure_kPa = 6.0;
  std::vector<double> misses_kPa;
  for (const std::array<size_t, 3> elements : {std::array<size_t, 3>{8, 4, 1}, {8, 8, 2}}) {
    ElasticModel model = gel(tube_c1_kPa, elements);
    const Solution solution = model.solve(pressure_kPa);
    ASSERT_TRUE(solution.report.converged());
    const auto radial_kPa = [&](size_t layer, const Xi& xi) {
      const size_t element = elements[0] * (elements[1] / 2 + elements[1] * layer);
      const PointFields fields = point_fields(model.system(), solution.state, {element, xi});
      return along(fields.wall.deformed, fields.stress_kPa)[2];
    };
    double miss_kPa = 0.0;
    for (const double xi1 : {0.0, 0.3, 0.5}) {
      for (const double xi2 : {0.0, 0.3, 0.6}) {
        miss_kPa = std::max({miss_kPa, std::abs(radial_kPa(0, {xi1, xi2, 0.0}) + pressure_kPa),
                             std::abs(radial_kPa(elements[2] - 1, {xi1, xi2, 1.0}))});
      }
    }
    misses_kPa.push_back(miss_kPa);
  }
  EXPECT_LT(misses_kPa[0], 0.06 * pressure_kPa);
  EXPECT_LT(misses_kPa[1], 0.5 * misses_kPa[0]);
}

TEST(AveragedPressure, IsOneAtANodeAndBringsTheTractionCloserToTheLoad) {
  constexpr double pressure_kPa = 6.0;
  ElasticModel model = gel(tube_c1_kPa, {8, 8, 2});
  const Solution solution = model.solve(pressure_kPa);
  ASSERT_TRUE(solution.report.converged());
  const ElasticState averaged = with_averaged_pressure(model.system(), solution.state);
  constexpr size_t at_equator = 32;
  const auto miss_kPa = [&](const ElasticState& state) {
    double most = 0.0;
    for (const double xi2 : {0.0, 0.3, 0.6}) {
      const PointFields fields = point_fields(model.system(), state, {at_equator, {0.3, xi2, 0.0}});
      most = std::max(most, std::abs(along(fields.wall.deformed, fields.stress_kPa)[2] + pressure_kPa));
    }
    return most;
  };
  EXPECT_LT(miss_kPa(averaged), 0.7 * miss_kPa(solution.state));
  const auto pressure = [&](const MaterialPoint& point) {
    return point_fields(model.system(), averaged, point).lagrange_pressure_kPa;
  };
  EXPECT_NEAR(pressure({at_equator, {0.0, 0.0, 1.0}}), pressure({at_equator + 64 - 8, {0.0, 1.0, 0.0}}),
              1e-12);
}

// At rest each element's pressure is its own 2 C1, which no neighbour of another C1 may change.
TEST(AveragedPressure, KeepsItsJumpWhereTheMaterialChanges) {
  ElasticModel model = gel(tube_c1_kPa, {6, 2, 2});
  for (size_t e = 0; e < 12; ++e)
    model.set_element_parameter(0, e, 2.0 * tube_c1_kPa);
  ElasticState state = model.solve(0.0).state;
  const std::vector<double> own = state.lagrange_pressure_kPa;
  state = with_averaged_pressure(model.system(), state);
  EXPECT_LT(largest_difference(state.lagrange_pressure_kPa, own), 1e-9);
}

/// Force across the surface xi2 = 0 of a ring of elements along z: integral of P N dA of the undeformed cut.
double axial_force_mN(const ElasticModel& model, const ElasticState& state, size_t around, size_t up,
                      size_t out, size_t level) {
  const HermiteMesh& mesh = model.mesh();
  double force = 0.0;
  for (size_t i3 = 0; i3 < out; ++i3) {
    for (size_t i1 = 0; i1 < around; ++i1) {
      for (size_t q = 0; q < 16; ++q) {
        const MaterialPoint point{i1 + around * (level + up * i3),
                                  {line_rule_4().place[q & 3], 0.0, line_rule_4().place[q >> 2]}};
        const PointFields fields = point_fields(model.system(), state, point);
        const Eigen::Matrix3d tangents = mesh.xi_gradient(mesh.reference(), point);
        const Eigen::Vector3d area_mm2 = tangents.col(2).cross(tangents.col(0));
        const Eigen::Matrix3d nominal_kPa =
            fields.volume_ratio * fields.stress_kPa * fields.deformation_gradient.inverse().transpose();
        force += line_rule_4().weight[q & 3] * line_rule_4().weight[q >> 2] * (nominal_kPa * area_mm2)[2];
      }
    }
  }
  return force;
}

TEST(PointFields, HoldAVentriclesApexAgainstThePressureOverItsOpening) {
  // Laplace: what a cut through the wall carries is the pressure times the opening's area.
  EllipsoidShape shape;
  shape.elements = {4, 4, 2};
  ElasticOptions options{.parameters = {2.0, 8.0, 2.0, 4.0}};
  options.material_axes = material_axes_of(ellipsoid_fibres(shape, 60.0, -60.0));
  ElasticModel model(make_ellipsoid(shape), *find_law("guccione"), std::move(options));
  constexpr double pressure_kPa = 0.5;
  const Solution solution = model.solve(pressure_kPa);
  ASSERT_TRUE(solution.report.converged());
  constexpr size_t level = 2;
  double opening_mm2 = 0.0;
  for (size_t i1 = 0; i1 < 4; ++i1) {
    for (size_t q = 0; q < 4; ++q) {
      const MaterialPoint point{i1 + 4 * level, {line_rule_4().place[q], 0.0, 0.0}};
      const Eigen::Vector3d place = model.mesh().value(solution.state.position_mm, point);
      const Eigen::Vector3d along_rim = model.mesh().xi_gradient(solution.state.position_mm, point).col(0);
      opening_mm2 += line_rule_4().weight[q] * 0.5 * (place[0] * along_rim[1] - place[1] * along_rim[0]);
    }
  }
  const double force = axial_force_mN(model, solution.state, 4, 4, 2, level);
  EXPECT_NEAR(force, pressure_kPa * opening_mm2, 0.02 * force);
}

TEST(PointFields, InFibreAxesFollowTheFibre) {
  // A block sheared and stretched by a known F: the fibre's stretch, and a stress that is the law's.
  EllipsoidShape shape;
  shape.elements = {4, 2, 1};
  ElasticOptions options{.parameters = {2.0, 8.0, 2.0, 4.0}};
  options.material_axes = material_axes_of(ellipsoid_fibres(shape, 60.0, -60.0));
  ElasticModel model(make_ellipsoid(shape), *find_law("guccione"), std::move(options));
  ElasticState state = model.rest_state();
  Eigen::Matrix3d gradient;
  gradient << 1.1, 0.2, 0.0, 0.0, 0.9, 0.1, 0.0, 0.0, 1.0;
  for (size_t start = 0; start < state.position_mm.size(); start += 3) {
    Eigen::Map<Eigen::Vector3d> value(&state.position_mm[start]);
    value = (gradient * value).eval();
  }
  state.fibre_tension_kPa = 3.0;
  const PointFields fields = point_fields(model.system(), state, {1, {0.2, 0.6, 0.25}});
  EXPECT_LT((fields.deformation_gradient - gradient).norm(), 1e-10);
  ASSERT_TRUE(fields.fibre);
  const Eigen::Vector3d fibre = fields.fibre->reference.col(0);
  EXPECT_NEAR(fields.wall.reference.col(0).dot(fibre), std::cos(30.0 * M_PI / 180.0), 1e-12);
  const double stretch = (gradient * fibre).norm();
  EXPECT_NEAR(stretch_along_first(fields, *fields.fibre), stretch, 1e-12);
  EXPECT_NEAR(along(fields.fibre->reference, fields.green_strain)[0], 0.5 * (stretch * stretch - 1.0), 1e-12);
  for (const CarriedAxes& axes : {fields.wall, *fields.fibre}) {
    EXPECT_LT((axes.deformed.transpose() * axes.deformed - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_GT(axes.deformed.determinant(), 0.0);
  }
  EXPECT_GT(fields.fibre->deformed.col(0).dot(gradient * fibre), 0.999 * stretch);
  // The tension alone: 3 kPa of second Piola-Kirchhoff stress is T stretch^2 / J along the fibre.
  ElasticState relaxed = state;
  relaxed.fibre_tension_kPa = 0.0;
  const PointFields without = point_fields(model.system(), relaxed, {1, {0.2, 0.6, 0.25}});
  const SymmetricTensor<double> added = along(fields.fibre->deformed, fields.stress_kPa - without.stress_kPa);
  EXPECT_NEAR(added[0], 3.0 * stretch * stretch / gradient.determinant(), 1e-10);
  EXPECT_NEAR(added[1], 0.0, 1e-10);
  EXPECT_NEAR(added[2], 0.0, 1e-10);
  const std::vector<double> scalars = scalar_fields(fields);
  ASSERT_EQ(scalars.size(), scalar_field_names(true).size());
  EXPECT_EQ(scalar_field_names(true).back(), "fibre_stretch");
  EXPECT_NEAR(scalars.back(), stretch, 1e-12);
}

}  // namespace
}  // namespace diastole
