// Refined meshes in the solver: the coarse solution is a state of the finer mesh, with the same energy, volume and
// stress; a finer mesh is nearer to the converged body, and stable.

#include <gtest/gtest.h>

#include "estimator/fe/point_fields.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/refinement.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

ElasticModel gel_on(HermiteMesh mesh, double c1_kPa) {
  return ElasticModel(std::move(mesh), *find_law("neo-hookean"),
                      {.parameters = {c1_kPa}, .solve = {.check_stability = true}});
}

HermiteMesh refined(const HermiteMesh& mesh, const std::array<size_t, 3>& halvings) {
  HermiteMesh finer = mesh;
  for (size_t direction = 0; direction < 3; ++direction) {
    for (size_t i = 0; i < halvings[direction]; ++i)
      finer = Refinement(finer, direction).mesh();
  }
  return finer;
}

/// The coarse mesh's pressures on the children of its elements.
std::vector<double> prolonged_pressure(const ElasticSystem& coarse, const ElasticState& state,
                                       const ElasticSystem& fine, size_t direction) {
  std::vector<double> pressure_kPa(fine.pressures().count);
  for (size_t child = 0; child < fine.mesh().element_count(); ++child) {
    for (size_t m = 0; m < corners; ++m) {
      Xi xi{};
      for (size_t k = 0; k < 3; ++k)
        xi[k] = static_cast<double>((m >> k) & 1);
      xi[direction] = 0.5 * (xi[direction] + static_cast<double>(child % 2));
      pressure_kPa[fine.pressures().unknown[child][m]] =
          point_fields(coarse, state, {child / 2, xi}).lagrange_pressure_kPa;
    }
  }
  return pressure_kPa;
}

TEST(RefinedModel, HoldsTheCoarseSolutionAsItIs) {
  ElasticModel coarse = gel(6.5, {6, 2, 1});
  const Solution solution = coarse.solve(3.0);
  ASSERT_TRUE(solution.report.converged());
  for (size_t direction = 0; direction < 3; ++direction) {
    const Refinement refinement(coarse.mesh(), direction);
    const ElasticModel fine = gel_on(refinement.mesh(), 6.5);
    ElasticState same = solution.state;
    same.position_mm = refinement.prolonged(solution.state.position_mm);
    same.lagrange_pressure_kPa =
        prolonged_pressure(coarse.system(), solution.state, fine.system(), direction);
    EXPECT_NEAR(fine.cavity_volume_mL(same), coarse.cavity_volume_mL(solution.state), 1e-9);
    // Up to the quadrature, which has twice the points.
    EXPECT_NEAR(fine.stored_energy_mJ(same), coarse.stored_energy_mJ(solution.state),
                2e-3 * coarse.stored_energy_mJ(solution.state));
    MaterialPoint child{7, {0.2, 0.4, 0.6}};
    MaterialPoint parent{3, child.xi};
    parent.xi[direction] = 0.5 * (child.xi[direction] + 1.0);
    EXPECT_LT((point_fields(fine.system(), same, child).stress_kPa -
               point_fields(coarse.system(), solution.state, parent).stress_kPa)
                  .norm(),
              1e-9);
  }
}

TEST(RefinedModel, ComesCloserToTheConvergedGel) {
  // Not monotone in energy: the pressures' space grows too, and holds the volume more strictly.
  constexpr double converged_mL = 35.761;  // P = 2 kPa, C1 = 4 kPa
  const HermiteMesh coarse = make_annulus(gel_shape({8, 2, 1}));
  double before_mL = 1e9;
  for (const std::array<size_t, 3>& halvings : {std::array<size_t, 3>{0, 0, 0}, {0, 1, 1}}) {
    ElasticModel model = gel_on(refined(coarse, halvings), 4.0);
    const Solution solution = model.solve(2.0);
    ASSERT_TRUE(solution.report.converged());
    EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns);
    const double miss_mL = std::abs(model.cavity_volume_mL(solution.state) -
                                    model.cavity_volume_mL(model.rest_state()) - converged_mL);
    EXPECT_LT(miss_mL, 0.6 * before_mL);
    before_mL = miss_mL;
  }
  EXPECT_LT(before_mL, 0.005 * converged_mL);
}

TEST(RefinedModel, IsAHeartThatStaysStableAtItsApex) {
  EllipsoidShape shape;
  shape.elements = {4, 2, 1};
  const HermiteMesh coarse = make_ellipsoid(shape);
  const FibreField fibres = ellipsoid_fibres(shape, 60.0, -60.0);
  for (size_t direction = 0; direction < 3; ++direction) {
    const Refinement finer(coarse, direction);
    ElasticOptions options{.parameters = {2.0, 8.0, 2.0, 4.0}, .solve = {.check_stability = true}};
    options.material_axes = material_axes_of(fibres.prolonged(finer));
    ElasticModel model(finer.mesh(), *find_law("guccione"), std::move(options));
    const Solution solution = model.solve(0.5);
    ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
    EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns) << direction;
  }
}

}  // namespace
}  // namespace diastole
