// Every law on a block with a displaced inner node: uniaxial and equibiaxial tension and simple shear
// between plates, against the homogeneous solution, which the law's stress at one C gives.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "estimator/mesh/block.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

using Tensor = SymmetricTensor<double>;

constexpr std::array<double, 3> size_mm{2.0, 1.5, 1.0};
constexpr double volume_mm3 = 3.0;

HermiteMesh distorted_block() {
  HermiteMesh regular = make_block({size_mm, {2, 2, 2}});
  NodeField reference = regular.reference();
  const size_t middle = 13;  // of 3 x 3 x 3 nodes
  const Eigen::Vector3d shift(0.13, -0.07, 0.06);
  for (size_t i = 0; i < 3; ++i)
    reference[dof_of(middle, 0, i)] += shift[static_cast<Eigen::Index>(i)];
  std::vector<HermiteMesh::Corners> elements;
  for (size_t e = 0; e < regular.element_count(); ++e)
    elements.push_back(regular.element(e));
  return HermiteMesh(std::move(reference), std::move(elements), regular.faces());
}

NodeField deformed(const HermiteMesh& mesh, const Eigen::Matrix3d& f) {
  NodeField field = mesh.reference();
  for (size_t start = 0; start < field.size(); start += 3) {
    const Eigen::Vector3d moved = f * Eigen::Vector3d(&field[start]);
    std::copy_n(moved.data(), 3, &field[start]);
  }
  return field;
}

double bisect(double low, double high, const auto& f) {
  const bool rising = f(high) > f(low);
  EXPECT_LT(f(low) * f(high), 0.0) << "no root between " << low << " and " << high;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    ((f(middle) > 0.0) == rising ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

class Homogeneous : public testing::TestWithParam<const Law*> {
 protected:
  Homogeneous() {
    for (const LawParameter& parameter : law.parameters())
      values.push_back(parameter.typical);
  }

  /// F S F^T's diagonal for principal stretches along the material axes, kPa: Cauchy stress without pressure.
  Eigen::Vector3d extra_stress(const Eigen::Vector3d& stretch) const {
    const Eigen::Vector3d square = stretch.cwiseAbs2();
    const Tensor s = law.stress({square[0], square[1], square[2], 0.0, 0.0, 0.0}, values);
    return Eigen::Vector3d(s[0], s[1], s[2]).cwiseProduct(square);
  }

  /// Holds the block between frictionless plates `stretch` apart in some directions, starts it from a shaken
  /// state, and compares with the homogeneous solution: faces across the last direction are free.
  void expect_stretches(const Eigen::Vector3d& stretch, bool second_held) {
    const HermiteMesh mesh = distorted_block();
    const MeshFaces& faces = mesh.faces();
    HeldDofs held = hold_nothing(mesh);
    for (const auto& plate : {faces.left, faces.right})
      hold_face_component(mesh, plate, 0, held);
    hold_face_component(mesh, faces.bottom, 1, held);
    if (second_held) hold_face_component(mesh, faces.top, 1, held);
    hold_face_component(mesh, faces.inner, 2, held);
    ElasticModel model(mesh, law, {.parameters = values, .held = held});
    ElasticState exact = model.rest_state();
    exact.position_mm = deformed(mesh, stretch.asDiagonal());
    const Solution solution = model.solve(0.0, shaken(model.system(), exact, 0.01, 3));
    ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
    EXPECT_LT(largest_difference(solution.state.position_mm, exact.position_mm), 1e-6);
    const Eigen::Vector3d extra = extra_stress(stretch);
    for (const double p : solution.state.lagrange_pressure_kPa)
      EXPECT_NEAR(p, extra[2], 1e-6 * extra.cwiseAbs().maxCoeff());  // nothing pulls across the free faces
    const Tensor c{stretch[0] * stretch[0], stretch[1] * stretch[1], stretch[2] * stretch[2], 0.0, 0.0, 0.0};
    const double energy_uJ = law.energy(c, values) * volume_mm3;
    EXPECT_NEAR(1e3 * model.stored_energy_mJ(solution.state), energy_uJ, 1e-6 * energy_uJ);
  }

  const Law& law = *GetParam();
  std::vector<double> values;
};

TEST_P(Homogeneous, UniaxialTensionAlongTheFibre) {
  constexpr double fibre = 1.08;
  const auto stretches = [=](double second) {
    return Eigen::Vector3d(fibre, second, 1.0 / (fibre * second));
  };
  const double second = bisect(0.8, 1.15, [&](double l) {
    const Eigen::Vector3d extra = extra_stress(stretches(l));
    return extra[1] - extra[2];
  });
  expect_stretches(stretches(second), false);
}

TEST_P(Homogeneous, EquibiaxialTension) {
  constexpr double fibre = 1.03;
  const auto stretches = [=](double second) {
    return Eigen::Vector3d(fibre, second, 1.0 / (fibre * second));
  };
  const double second = bisect(1.0, 1.45, [&](double l) {
    const Eigen::Vector3d extra = extra_stress(stretches(l));
    return extra[1] - extra[0];
  });
  expect_stretches(stretches(second), true);
}

TEST_P(Homogeneous, SimpleShear) {
  Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
  f(0, 2) = 0.2;
  const HermiteMesh mesh = distorted_block();
  HeldDofs held = hold_nothing(mesh);
  for (const auto& plate : {mesh.faces().left, mesh.faces().right, mesh.faces().inner, mesh.faces().outer})
    hold_face(mesh, plate, held);
  hold_face_component(mesh, mesh.faces().bottom, 1, held);
  ElasticModel model(mesh, law, {.parameters = values, .held = held});
  ElasticState exact = model.rest_state();
  exact.position_mm = deformed(mesh, f);
  const ElasticState start = shaken(model.system(), exact, 0.01, 3);
  const Solution solution = model.solve(0.0, start);
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_LT(largest_difference(solution.state.position_mm, exact.position_mm), 1e-6);
  const Tensor c = symmetric_part(f.transpose() * f);
  const Tensor stress = law.stress(c, values);
  const double scale_kPa = std::abs(stress[1]) + law.response(c, values).tangent.norm();
  for (const double p : solution.state.lagrange_pressure_kPa)
    EXPECT_NEAR(p, stress[1], 1e-6 * scale_kPa);  // nothing pulls across the free faces
  const double energy_uJ = law.energy(c, values) * volume_mm3;
  EXPECT_NEAR(1e3 * model.stored_energy_mJ(solution.state), energy_uJ, 1e-6 * energy_uJ);
}

std::string test_name(const testing::TestParamInfo<const Law*>& info) {
  std::string name(info.param->name());
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(List, Homogeneous, testing::ValuesIn(all_laws()), test_name);

/// A short beam at some attitude, clamped at one end, pushed from one side; answers the deformed node field.
NodeField pushed_beam(const Law& law, std::vector<double> values, const Eigen::Matrix3d& attitude,
                      const Eigen::Matrix3d& axes) {
  HermiteMesh upright = make_block({{4.0, 1.0, 1.0}, {2, 1, 1}});
  std::vector<HermiteMesh::Corners> elements{upright.element(0), upright.element(1)};
  const HermiteMesh mesh(deformed(upright, attitude), elements, upright.faces());
  ElasticOptions options{.parameters = std::move(values), .held = hold_nothing(mesh)};
  hold_face(mesh, mesh.faces().left, *options.held);
  options.material_axes = [&](const HermiteMesh&, const MaterialPoint&) {
    return Eigen::Matrix3d(attitude * axes);
  };
  ElasticModel model(mesh, law, options);
  const Solution solution = model.solve(0.05);
  EXPECT_TRUE(solution.report.converged()) << solution.report.describe();
  return solution.state.position_mm;
}

const Eigen::Matrix3d some_turn =
    Eigen::AngleAxisd(0.9, Eigen::Vector3d(0.4, -0.7, 0.5).normalized()).toRotationMatrix();
const Eigen::Matrix3d upright = Eigen::Matrix3d::Identity();

TEST(MaterialAxes, DoNotMatterToAnIsotropicLaw) {
  const Law& law = *find_law("demiray");
  const NodeField plain = pushed_beam(law, {2.0, 1.0}, upright, upright);
  EXPECT_LT(largest_difference(pushed_beam(law, {2.0, 1.0}, upright, some_turn), plain), 1e-8);
}

TEST(MaterialAxes, TurnWithTheBody) {
  const Law& law = *find_law("guccione");
  const std::vector<double> values{2.0, 8.0, 2.0, 4.0};
  const Eigen::Matrix3d oblique = Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const NodeField still = pushed_beam(law, values, upright, oblique);
  NodeField turned = pushed_beam(law, values, some_turn, oblique);
  for (size_t start = 0; start < turned.size(); start += 3) {
    const Eigen::Vector3d back = some_turn.transpose() * Eigen::Vector3d(&turned[start]);
    std::copy_n(back.data(), 3, &turned[start]);
  }
  EXPECT_LT(largest_difference(turned, still), 1e-7);
  EXPECT_GT(largest_difference(pushed_beam(law, values, upright, upright), still), 1e-2);
}

}  // namespace
}  // namespace diastole
