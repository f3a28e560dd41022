// A thick-walled tube that is inflated and twisted between its ends, against the closed form (R. S. Rivlin, Phil. Trans.
// R. Soc. A 242 (1949) 173-195):
//
//   r^2 = R^2 + c,  theta = Theta + tau Z,  z = Z;       W = C1 (I1 - 3),  sigma = 2 C1 B - p I
//
//   d sigma_rr/dr = 2 C1 (r/R^2 + r tau^2 - R^2/r^3)     radial equilibrium; free outside, -P inside:
//   P = 2 C1 [ln(B a / (A b)) + c/2 (1/a^2 - 1/b^2)] + C1 tau^2 (b^2 - a^2)
//   M = pi C1 tau (b^4 - a^4)                            the moment at every section
//
// with A, B the undeformed and a, b the deformed radii. Twisting alone (c = 0) needs a pressure to keep the bore open.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/estimator/fe/gel.hpp"
#include "tools/benchmarks/verification/mixed_derivatives.hpp"

namespace diastole {
namespace {

Mixed cos(const Mixed& a) {
  const double s = std::sin(a.part[0]);
  const double c = std::cos(a.part[0]);
  return composed(a, {c, -s, -c, s});
}

Mixed sqrt(const Mixed& a) {
  const double x = a.part[0];
  const double root = std::sqrt(x);
  return composed(a, {root, 0.5 / root, -0.25 / (root * x), 0.375 / (root * x * x)});
}

Mixed reciprocal(const Mixed& a) {
  const double r = 1.0 / a.part[0];
  return composed(a, {r, -r * r, 2.0 * r * r * r, -6.0 * r * r * r * r});
}

constexpr double rod_c1_kPa = 6.5;

struct TwistedTube {
  double c_mm2 = 0.0;
  double tau_per_mm = 0.0;
  AnnulusShape shape = [] {
    AnnulusShape tube = gel_shape({8, 2, 3});
    tube.height_mm = 40.0;
    tube.plate_grading = 0.0;
    return tube;
  }();

  [[nodiscard]] double moved(double radius) const { return std::sqrt(radius * radius + c_mm2); }

  [[nodiscard]] double pressure_kPa() const {
    const double a = moved(shape.inner_radius_mm);
    const double b = moved(shape.outer_radius_mm);
    return 2.0 * rod_c1_kPa *
               (std::log(shape.outer_radius_mm * a / (shape.inner_radius_mm * b)) +
                0.5 * c_mm2 * (1.0 / (a * a) - 1.0 / (b * b))) +
           rod_c1_kPa * tau_per_mm * tau_per_mm * (b * b - a * a);
  }
  [[nodiscard]] double moment_mJ() const {
    const double a = moved(shape.inner_radius_mm);
    const double b = moved(shape.outer_radius_mm);
    return 1e-3 * std::numbers::pi * rod_c1_kPa * tau_per_mm * (std::pow(b, 4) - std::pow(a, 4));
  }
  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector3d& from) const {
    const double radius = from.head<2>().norm();
    const Eigen::Vector3d turned = Eigen::AngleAxisd(tau_per_mm * from[2], Eigen::Vector3d::UnitZ()) * from;
    const double stretch = moved(radius) / radius;
    return {stretch * turned[0], stretch * turned[1], turned[2]};
  }
  [[nodiscard]] NodeField nodes(const HermiteMesh& mesh) const {
    return mapped(mesh, [this](const std::array<Mixed, 3>& at) {
      const auto& [x, y, z] = at;
      const Mixed square = x * x + y * y;
      Mixed grown = square;
      grown.part[0] += c_mm2;
      const Mixed stretch = sqrt(grown * reciprocal(square));
      const Mixed s = sin(tau_per_mm * z);
      const Mixed c = cos(tau_per_mm * z);
      return std::array<Mixed, 3>{stretch * (c * x + -1.0 * (s * y)), stretch * (s * x + c * y), z};
    });
  }
};

/// The moment about z that the part above a level of element boundaries exerts on the part below, mJ (kPa mL).
double moment_mJ(const ElasticModel& model, const ElasticState& state, size_t level) {
  const HermiteMesh& mesh = model.mesh();
  const LineRule<5> rule = line_rule_5();
  double moment = 0.0;
  for (size_t layer = 0; layer < 3; ++layer) {
    for (size_t around = 0; around < 8; ++around) {
      const size_t e = around + 8 * (level + 2 * layer);
      for (size_t q = 0; q < 25; ++q) {
        const MaterialPoint point{e, {rule.place[q % 5], 0.0, rule.place[q / 5]}};
        const Eigen::Matrix3d g = mesh.xi_gradient(mesh.reference(), point);
        const double area = rule.weight[q % 5] * rule.weight[q / 5] * g.col(0).cross(g.col(2)).norm();
        const Eigen::Matrix3d f = mesh.reference_gradient(state.position_mm, point);
        double p = 0.0;
        const std::array<double, corners> basis = trilinear_basis(point.xi);
        for (size_t m = 0; m < corners; ++m)
          p += basis[m] * state.lagrange_pressure_kPa[corners * e + m];
        const Eigen::Vector3d traction =
            (2.0 * rod_c1_kPa * f - p * f.determinant() * f.inverse().transpose()).col(2);
        moment += area * mesh.value(state.position_mm, point).cross(traction)[2];
      }
    }
  }
  return 1e-3 * moment;
}

class TubeTwist : public testing::TestWithParam<TwistedTube> {};

TEST_P(TubeTwist, MatchesTheClosedForm) {
  const TwistedTube& tube = GetParam();
  HermiteMesh mesh = make_annulus(tube.shape);
  const NodeField exact = tube.nodes(mesh);
  ElasticModel model(std::move(mesh), *find_law("neo-hookean"),
                     {.parameters = {rod_c1_kPa}, .solve = {.check_stability = true}});
  ElasticState start = model.rest_state();
  start.position_mm = exact;  // the bonded ends stay where this puts them
  const Solution solution = model.solve(tube.pressure_kPa(), shaken(model.system(), start, 0.02, 7));
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns);
  double farthest_mm = 0.0;
  for (size_t e = 0; e < model.mesh().element_count(); ++e) {
    for (const Xi& xi : {Xi{0.0, 0.5, 0.0}, Xi{0.5, 0.3, 0.5}, Xi{0.2, 0.9, 1.0}}) {
      const Eigen::Vector3d from = model.mesh().value(model.mesh().reference(), {e, xi});
      const Eigen::Vector3d to = model.mesh().value(solution.state.position_mm, {e, xi});
      farthest_mm = std::max(farthest_mm, (to - tube.place(from)).norm());
    }
  }
  EXPECT_LT(farthest_mm, 2e-3 * (tube.moved(tube.shape.inner_radius_mm) - tube.shape.inner_radius_mm +
                                 tube.tau_per_mm * tube.shape.height_mm * tube.shape.inner_radius_mm));
  EXPECT_NEAR(moment_mJ(model, solution.state, 1), tube.moment_mJ(), 1e-3 * (tube.moment_mJ() + 1.0));
}

std::string tube_name(const testing::TestParamInfo<TwistedTube>& listed) {
  const bool grows = listed.param.c_mm2 != 0.0;
  if (listed.param.tau_per_mm == 0.0) return "Inflation";
  return grows ? "InflationAndTorsion" : "Torsion";
}

INSTANTIATE_TEST_SUITE_P(Rivlin, TubeTwist,
                         testing::Values(TwistedTube{0.0, 0.02}, TwistedTube{250.0, 0.0},
                                         TwistedTube{250.0, 0.02}),
                         tube_name);

}  // namespace
}  // namespace diastole
