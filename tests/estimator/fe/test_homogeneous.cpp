// Every law on a block with a displaced inner node: uniaxial, biaxial and equibiaxial tension and simple shear
// between plates, with the fibre along each axis in turn, against the homogeneous solution of an energy that is typed
// a second time (typed_energies.hpp).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "estimator/mesh/block.hpp"
#include "tests/estimator/fe/gel.hpp"
#include "tests/estimator/materials/typed_energies.hpp"

namespace diastole {
namespace {

using RealVector = Eigen::Matrix<Real, 3, 1>;

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

/// A root of f, where a value that is no number (beyond a law's pole) counts as high.
Real bisect(Real low, Real high, const std::function<Real(Real)>& f) {
  EXPECT_LT(f(low), 0) << "no root between " << static_cast<double>(low) << " and "
                       << static_cast<double>(high);
  EXPECT_FALSE(f(high) <= 0) << "no root between " << static_cast<double>(low) << " and "
                             << static_cast<double>(high);
  for (int i = 0; i < 100; ++i) {
    const Real middle = (low + high) / 2;
    (f(middle) < 0 ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// A law at its typical values with its fibre along x, y or z; sheet and normal follow cyclically.
struct LawAndFibre {
  const Law* law;
  Eigen::Index fibre;
};

std::vector<LawAndFibre> all_laws_and_fibres() {
  std::vector<LawAndFibre> all;
  for (const Law* law : all_laws()) {
    for (const Eigen::Index fibre : {0, 1, 2})
      all.push_back({law, fibre});
  }
  return all;
}

class Homogeneous : public testing::TestWithParam<LawAndFibre> {
 protected:
  Homogeneous() {
    for (const LawParameter& parameter : law.parameters()) {
      values.push_back(parameter.typical);
      typed_values.push_back(static_cast<Real>(parameter.typical));
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      axes((GetParam().fibre + axis) % 3, axis) = 1.0;
  }

  /// The energy of a deformation gradient, typed independently of the law.
  Real energy(const RealMatrix& f) const {
    const RealMatrix in_axes = f * axes.cast<Real>();
    return energy_of_c(in_axes.transpose() * in_axes, typed_values);
  }
  Real energy(Real x, Real y, Real z) const { return energy(RealMatrix(RealVector(x, y, z).asDiagonal())); }

  /// Cauchy stress without pressure, l_i dW/dl_i, for stretches along x, y, z.
  Eigen::Vector3d extra_stress(const RealVector& l) const {
    Eigen::Vector3d stress;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Real short_of_rest = std::abs(l[i] - 1) / 4;  // where tension-only fibres have a kink
      stress[i] = static_cast<double>(l[i] * numerical_slope(
                                                 [&](Real changed) {
                                                   RealVector at = l;
                                                   at[i] = changed;
                                                   return energy(at[0], at[1], at[2]);
                                                 },
                                                 l[i], std::clamp(short_of_rest, Real(1e-7L), Real(1e-4L))));
    }
    return stress;
  }

  ElasticModel model_on(const HermiteMesh& mesh, const HeldDofs& held) const {
    ElasticOptions options{.parameters = values, .held = held};
    options.material_axes = [turn = axes](const HermiteMesh&, const MaterialPoint&) { return turn; };
    options.solve.newton_limit = 60;  // tension-only fibres next to their rest length switch on and off
    return ElasticModel(mesh, law, options);
  }

  /// The law's own Cauchy stress at F, with a pressure.
  Eigen::Matrix3d cauchy_kPa(const Eigen::Matrix3d& f, double pressure_kPa) const {
    const Eigen::Matrix3d in_axes = f * axes;
    const Eigen::Matrix3d s = full_matrix(law.stress(symmetric_part(in_axes.transpose() * in_axes), values));
    return in_axes * s * in_axes.transpose() - pressure_kPa * Eigen::Matrix3d::Identity();
  }

  /// Solves from a shaken homogeneous state and finds F again, everywhere, with its pressure and its energy.
  void expect_found_again(ElasticModel& model, const Eigen::Matrix3d& f, double pressure_kPa,
                          double scale_kPa) {
    ElasticState exact = model.rest_state();
    exact.position_mm = deformed(model.mesh(), f);
    const Solution solution = model.solve(0.0, shaken(model.system(), exact, 0.003, 3));
    ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
    EXPECT_LT(largest_difference(solution.state.position_mm, exact.position_mm), 1e-6);
    for (const double p : solution.state.lagrange_pressure_kPa)
      EXPECT_NEAR(p, pressure_kPa, 1e-6 * scale_kPa);
    const double energy_uJ = static_cast<double>(energy(f.cast<Real>())) * volume_mm3;
    EXPECT_NEAR(1e3 * model.stored_energy_mJ(solution.state), energy_uJ, 1e-6 * energy_uJ);
  }

  /// The block between frictionless plates `stretch` apart in some directions; faces across the last are free.
  void expect_stretches(const RealVector& stretch, bool second_held) {
    const HermiteMesh mesh = distorted_block();
    const MeshFaces& faces = mesh.faces();
    HeldDofs held = hold_nothing(mesh);
    for (const auto& plate : {faces.left, faces.right})
      hold_face_component(mesh, plate, 0, held);
    hold_face_component(mesh, faces.bottom, 1, held);
    if (second_held) hold_face_component(mesh, faces.top, 1, held);
    hold_face_component(mesh, faces.inner, 2, held);
    ElasticModel model = model_on(mesh, held);
    const Eigen::Vector3d extra = extra_stress(stretch);
    const Eigen::Matrix3d f = stretch.cast<double>().asDiagonal();
    expect_found_again(model, f, extra[2], extra.cwiseAbs().maxCoeff());
    const Eigen::Matrix3d stress = cauchy_kPa(f, extra[2]);
    for (Eigen::Index i = 0; i < 3; ++i)
      EXPECT_NEAR(stress(i, i), extra[i] - extra[2], 1e-8 * extra.cwiseAbs().maxCoeff());
  }

  const Law& law = *GetParam().law;
  const TypedEnergy energy_of_c = typed_energy(law.name());
  std::vector<double> values;
  std::vector<Real> typed_values;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
};

RealVector isochoric(Real x, Real y) { return {x, y, 1 / (x * y)}; }

TEST_P(Homogeneous, UniaxialTension) {
  constexpr Real along = 1.08L;
  const Real second = bisect(0.8L, 1.15L, [&](Real l) {
    const Eigen::Vector3d extra = extra_stress(isochoric(along, l));
    return extra[1] - extra[2];
  });
  expect_stretches(isochoric(along, second), false);
}

TEST_P(Homogeneous, BiaxialTension) { expect_stretches(isochoric(1.03L, 1.01L), true); }

TEST_P(Homogeneous, EquibiaxialTension) {
  constexpr Real along = 1.015L;
  const Real second = bisect(0.98L, 1.35L, [&](Real l) {
    const Eigen::Vector3d extra = extra_stress(isochoric(along, l));
    return extra[1] - extra[0];
  });
  expect_stretches(isochoric(along, second), true);
}

// Between plates across z that slide along x, the block a little stretched, so that no fibre is at its rest length,
// where tension-only fibres have a kink. sigma_xz = l_z dW/d(shear); nothing pulls across the faces along y.
TEST_P(Homogeneous, SimpleShear) {
  Eigen::Matrix3d f = isochoric(0.97L, 1.02L).cast<double>().asDiagonal();
  f(0, 2) = 0.2;
  const HermiteMesh mesh = distorted_block();
  HeldDofs held = hold_nothing(mesh);
  for (const auto& plate : {mesh.faces().left, mesh.faces().right, mesh.faces().inner, mesh.faces().outer})
    hold_face(mesh, plate, held);
  hold_face_component(mesh, mesh.faces().bottom, 1, held);
  ElasticModel model = model_on(mesh, held);
  const auto slope_by_entry = [&](Eigen::Index row, Eigen::Index column) {
    return static_cast<double>(numerical_slope(
        [&](Real changed) {
          RealMatrix at = f.cast<Real>();
          at(row, column) = changed;
          return energy(at);
        },
        static_cast<Real>(f(row, column))));
  };
  const double sideways_kPa = f(1, 1) * slope_by_entry(1, 1);
  const double shear_kPa = f(2, 2) * slope_by_entry(0, 2);
  const double scale_kPa = std::abs(sideways_kPa) + std::abs(shear_kPa);
  expect_found_again(model, f, sideways_kPa, scale_kPa);
  const Eigen::Matrix3d stress = cauchy_kPa(f, sideways_kPa);
  EXPECT_NEAR(stress(0, 2), shear_kPa, 1e-8 * scale_kPa);
  EXPECT_NEAR(stress(1, 1), 0.0, 1e-8 * scale_kPa);
}

std::string test_name(const testing::TestParamInfo<LawAndFibre>& info) {
  std::string name(info.param.law->name());
  std::replace(name.begin(), name.end(), '-', '_');
  return name + "_fibre_along_" + "xyz"[info.param.fibre];
}

INSTANTIATE_TEST_SUITE_P(List, Homogeneous, testing::ValuesIn(all_laws_and_fibres()), test_name);

/// The block between plates that stretch it along x (and y), exactly homogeneous, of a law at its typical values.
struct StretchedBlock {
  ElasticModel model;
  ElasticState state;

  StretchedBlock(const Law& law, Eigen::Index fibre, double x, double y, bool second_held)
      : model(make(law, fibre, second_held)), state(model.rest_state()) {
    const Eigen::Matrix3d f = Eigen::Vector3d(x, y, 1.0 / (x * y)).asDiagonal();
    state.position_mm = deformed(model.mesh(), f);
    const Eigen::Matrix3d axes = model.system().material_axes()(model.mesh(), {});
    const Eigen::Matrix3d in_axes = f * axes;
    const Eigen::Matrix3d s =
        full_matrix(law.stress(symmetric_part(in_axes.transpose() * in_axes), model.system().parameters(0)));
    for (double& p : state.lagrange_pressure_kPa)
      p = (in_axes * s * in_axes.transpose())(2, 2);
  }

  static ElasticModel make(const Law& law, Eigen::Index fibre, bool second_held) {
    HermiteMesh mesh = distorted_block();
    ElasticOptions options{.held = hold_nothing(mesh)};
    for (const LawParameter& parameter : law.parameters())
      options.parameters.push_back(parameter.typical);
    for (const auto& plate : {mesh.faces().left, mesh.faces().right})
      hold_face_component(mesh, plate, 0, *options.held);
    hold_face_component(mesh, mesh.faces().bottom, 1, *options.held);
    if (second_held) hold_face_component(mesh, mesh.faces().top, 1, *options.held);
    hold_face_component(mesh, mesh.faces().inner, 2, *options.held);
    Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      axes((fibre + axis) % 3, axis) = 1.0;
    options.material_axes = [axes](const HermiteMesh&, const MaterialPoint&) { return axes; };
    return ElasticModel(std::move(mesh), law, std::move(options));
  }
};

// A rubber block in tension is stable, whatever eight pressures an element do not see of its volume.
TEST(Stability, DoesNotCountMotionsThatChangeTheVolume) {
  const double across = 1.0 / std::sqrt(1.08);
  for (const char* law : {"neo-hookean", "ogden"}) {
    StretchedBlock block(*find_law(law), 0, 1.08, across, false);
    const Stability stability = block.model.system().stability(block.state);
    EXPECT_GT(stability.negative_pivots, block.model.pressure_dofs()) << law;
    EXPECT_EQ(stability.unstable_motions, 0U) << law;
  }
}

/// The law's second derivative along a shear a x N of a homogeneous state; of a stable material it is positive for
/// all a that keep the volume (strong ellipticity).
double shear_stiffness_kPa(const StretchedBlock& block, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& normal) {
  const ElasticModel& model = block.model;
  const Eigen::Matrix3d axes = model.system().material_axes()(model.mesh(), {});
  const Eigen::Matrix3d f = model.mesh().reference_gradient(block.state.position_mm, {});
  const auto energy = [&](double amount) {
    const Eigen::Matrix3d sheared = (f + amount * a * normal.transpose()) * axes;
    return model.law().energy(symmetric_part(sheared.transpose() * sheared), model.system().parameters(0));
  };
  constexpr double h = 1e-3;
  return (energy(h) - 2.0 * energy(0.0) + energy(-h)) / (h * h);
}

// Why no solver finds the pole-zero block stretched by 6 and 2 % with its fibre across: compressed by 7.5 %, the law's
// fibres push harder than its shear holds, and the homogeneous state gives way by itself.
TEST(Stability, OfPoleZeroIsLostWhereCompressedFibresOutweighItsShear) {
  const Law& law = *find_law("pole-zero");
  StretchedBlock little(law, 2, 1.03, 1.01, true);
  EXPECT_GT(shear_stiffness_kPa(little, Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()), 0.15);
  EXPECT_EQ(little.model.system().stability(little.state).unstable_motions, 0U);
  StretchedBlock much(law, 2, 1.06, 1.02, true);
  EXPECT_LT(shear_stiffness_kPa(much, Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()), -0.15);
  EXPECT_GT(much.model.system().stability(much.state).unstable_motions, 0U);
}

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
