// Laws against formulas worked out by hand, and the symmetries that they are meant to have.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "estimator/materials/law.hpp"

namespace diastole {
namespace {

using Tensor = SymmetricTensor<double>;

constexpr Tensor rest{1.0, 1.0, 1.0, 0.0, 0.0, 0.0};

const Law& law_called(std::string_view name) {
  const Law* law = find_law(name);
  if (law == nullptr) throw std::logic_error("no such law: " + std::string(name));
  return *law;
}

std::vector<double> typical_values(const Law& law) {
  std::vector<double> values;
  for (const LawParameter& parameter : law.parameters())
    values.push_back(parameter.typical);
  return values;
}

Tensor turned(const Tensor& c, const Eigen::Matrix3d& turn) {
  return symmetric_part(turn.transpose() * full_matrix(c) * turn);
}

const Tensor general_c{1.21, 0.93, 1.06, 0.11, -0.07, 0.05};

/// Cauchy stress along a fibre or x in incompressible uniaxial tension of an isotropic law:
/// sigma = (S11 l^2 - S22 / l).
double uniaxial_kPa(const Law& law, const std::vector<double>& values, double stretch) {
  const Tensor c{stretch * stretch, 1.0 / stretch, 1.0 / stretch, 0.0, 0.0, 0.0};
  const Tensor s = law.stress(c, values);
  return s[0] * c[0] - s[1] * c[1];
}

TEST(LawValues, IsotropicLawsKnowNoAxes) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.2, 0.9, -0.4).normalized()).toRotationMatrix();
  for (const char* name : {"neo-hookean", "mooney-rivlin", "ogden", "demiray"}) {
    const Law& law = law_called(name);
    const std::vector<double> values = typical_values(law);
    const double energy = law.energy(general_c, values);
    EXPECT_NEAR(law.energy(turned(general_c, turn), values), energy, 1e-12 * energy) << name;
    const Tensor stress = law.stress(turned(general_c, turn), values);
    const Tensor expected = turned(law.stress(general_c, values), turn);
    for (size_t m = 0; m < 6; ++m)
      EXPECT_NEAR(stress[m], expected[m], 1e-10 * std::abs(expected[0])) << name;
  }
}

TEST(LawValues, TransverselyIsotropicLawsKnowTheFibreOnly) {
  const Eigen::Matrix3d about_fibre = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Eigen::Matrix3d about_sheet = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix();
  for (const char* name : {"guccione", "strain-attribute"}) {
    const Law& law = law_called(name);
    const std::vector<double> values = typical_values(law);
    const double energy = law.energy(general_c, values);
    EXPECT_NEAR(law.energy(turned(general_c, about_fibre), values), energy, 1e-12 * energy) << name;
    EXPECT_GT(std::abs(law.energy(turned(general_c, about_sheet), values) - energy), 1e-3 * energy) << name;
  }
}

TEST(LawValues, OrthotropicLawsKeepTheirThreeMirrors) {
  for (const char* name : {"pole-zero", "holzapfel-ogden"}) {
    const Law& law = law_called(name);
    const std::vector<double> values = typical_values(law);
    const double energy = law.energy(general_c, values);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Eigen::Matrix3d mirror = Eigen::Matrix3d::Identity();
      mirror(axis, axis) = -1.0;
      EXPECT_DOUBLE_EQ(law.energy(turned(general_c, mirror), values), energy) << name;
    }
  }
}

TEST(LawValues, UniaxialTensionOfRubbers) {
  for (const double l : {0.8, 1.1, 1.5, 2.0}) {
    EXPECT_NEAR(uniaxial_kPa(law_called("neo-hookean"), {8.71}, l), 2.0 * 8.71 * (l * l - 1.0 / l), 1e-11);
    EXPECT_NEAR(uniaxial_kPa(law_called("mooney-rivlin"), {170.0, 20.0}, l),
                2.0 * (l * l - 1.0 / l) * (170.0 + 20.0 / l), 1e-9);
    double ogden = 0.0;
    const std::vector<double> values = typical_values(law_called("ogden"));
    for (size_t i = 0; i < 6; i += 2)
      ogden += values[i] * (std::pow(l, values[i + 1]) - std::pow(l, -0.5 * values[i + 1]));
    EXPECT_NEAR(uniaxial_kPa(law_called("ogden"), values, l), ogden, 1e-9);
    const double i1 = l * l + 2.0 / l;
    EXPECT_NEAR(uniaxial_kPa(law_called("demiray"), {0.5, 1.5}, l),
                2.0 * 0.5 * std::exp(1.5 * (i1 - 3.0)) * (l * l - 1.0 / l), 1e-9);
  }
}

TEST(LawValues, DemirayWithoutStiffeningIsNeoHookean) {
  for (const double beta : {0.0, 1e-9}) {
    const MaterialResponse demiray = law_called("demiray").response(general_c, std::vector{8.71, beta});
    const Tensor neo = law_called("neo-hookean").stress(general_c, std::vector{8.71});
    for (size_t m = 0; m < 6; ++m)
      EXPECT_NEAR(demiray.stress[m], neo[m], 1e-7);
    EXPECT_NEAR(demiray.tangent.norm(), 0.0, 1e-6);
  }
}

TEST(LawValues, OgdenWithOneSquareTermIsNeoHookean) {
  const std::vector<double> ogden{20.0, 2.0, 0.0, 1.0, 0.0, 1.0};  // mu = 2 C1
  for (const Tensor& c : {rest, general_c, Tensor{1.2, 1.2, 0.7, 0.0, 0.0, 0.0}}) {
    const MaterialResponse response = law_called("ogden").response(c, ogden);
    const Tensor neo = law_called("neo-hookean").stress(c, std::vector{10.0});
    for (size_t m = 0; m < 6; ++m)
      EXPECT_NEAR(response.stress[m], neo[m], 1e-12 * 20.0);
    EXPECT_NEAR(response.tangent.norm(), 0.0, 1e-10);
  }
}

TEST(LawValues, OgdensTangentIsSmoothWhereStretchesCoalesce) {
  // With a single term of exponent 4, tr C^2 is a polynomial: S = 2 mu/4 2 C, D = 2 mu dC/dE... = 2 mu II.
  const Law& law = law_called("ogden");
  const std::vector<double> fourth{3.0, 4.0, 0.0, 1.0, 0.0, 1.0};
  for (const double apart : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.3}) {
    const Tensor c{1.1, 1.1 + apart, 1.1 + 2.0 * apart, 0.3 * apart, 0.0, -0.2 * apart};
    const MaterialResponse response = law.response(c, fourth);
    for (size_t m = 0; m < 6; ++m) {
      EXPECT_NEAR(response.stress[m], 3.0 * c[m], 1e-13 * 3.0) << apart;
      for (size_t n = 0; n < 6; ++n) {
        const double expected = m != n ? 0.0 : m < 3 ? 6.0 : 3.0;
        EXPECT_NEAR(response.tangent(static_cast<int>(m), static_cast<int>(n)), expected, 1e-11) << apart;
      }
    }
  }
}

TEST(LawValues, GuccioneAsThePaperPrintsIt) {
  const std::vector<double> values{3.0, 11.09, 1.76, 10.0};
  const auto e = [&](size_t m) { return 0.5 * (m < 3 ? general_c[m] - 1.0 : general_c[m]); };
  const double q = 11.09 * e(0) * e(0) + 1.76 * (e(1) * e(1) + e(2) * e(2) + 2.0 * e(4) * e(4)) +
                   2.0 * 10.0 * (e(3) * e(3) + e(5) * e(5));
  EXPECT_NEAR(law_called("guccione").energy(general_c, values), 1.5 * (std::exp(q) - 1.0), 1e-14);
}

TEST(LawValues, PoleZeroHasNoPoleInCompression) {
  const Law& law = law_called("pole-zero");
  const std::vector<double> values = typical_values(law);
  const double strain = -0.2;
  const Tensor c{1.0 + 2.0 * strain, 1.0, 1.0, 0.0, 0.0, 0.0};
  EXPECT_NEAR(law.energy(c, values), 2.0 * strain * strain / std::pow(0.475, 1.5), 1e-13);
  const Tensor beyond{1.0 + 2.0 * 0.48, 1.0, 1.0, 0.0, 0.0, 0.0};
  EXPECT_TRUE(std::isnan(law.energy(beyond, values)));
}

TEST(LawValues, HolzapfelOgdensFibresBearNoCompression) {
  const Law& law = law_called("holzapfel-ogden");
  std::vector<double> values = typical_values(law);
  const Tensor shortened{0.9, 0.95, 1.2, 0.0, 0.0, 0.0};
  const double with_fibres = law.energy(shortened, values);
  values[2] = values[4] = 1e-9;
  EXPECT_DOUBLE_EQ(law.energy(shortened, values), with_fibres);
}

TEST(LawValues, StrainAttributesDoNotOverlap) {
  // Each mode of deformation moves one attribute only: the others' constants do not matter.
  const Law& law = law_called("strain-attribute");
  const std::vector<double> values = typical_values(law);
  const double l = 1.15;
  const double cosh_shear = std::exp(0.2);
  const std::array<Tensor, 3> modes{Tensor{l * l, 1.0 / l, 1.0 / l, 0.0, 0.0, 0.0},
                                    Tensor{1.0, cosh_shear, 1.0 / cosh_shear, 0.0, 0.0, 0.0},
                                    Tensor{1.0, 1.0 + 0.2 * 0.2, 1.0, 0.2, 0.0, 0.0}};
  for (size_t mode = 0; mode < 3; ++mode) {
    for (size_t other = 0; other < 3; ++other) {
      std::vector<double> changed = values;
      changed[2 * other] *= 2.0;
      const double ratio = law.energy(modes[mode], changed) / law.energy(modes[mode], values);
      EXPECT_NEAR(ratio, mode == other ? 2.0 : 1.0, 1e-9) << mode << ' ' << other;
    }
  }
}

TEST(LawValues, StrainAttributesTypicalModuliAreGucciones) {
  // Small uniaxial stretch along the fibre and small shears: equal moduli at rest.
  const Law& attribute = law_called("strain-attribute");
  const Law& guccione = law_called("guccione");
  for (const Tensor& c : {Tensor{1.002, 0.999, 0.999, 0.0, 0.0, 0.0},
                          Tensor{1.0, 1.002, 0.998, 0.0, 0.0, 0.0}, Tensor{1.0, 1.0, 1.0, 0.002, 0.0, 0.0}}) {
    const double expected = guccione.energy(c, typical_values(guccione));
    EXPECT_NEAR(attribute.energy(c, typical_values(attribute)), expected, 0.01 * expected);
  }
}

}  // namespace
}  // namespace diastole
