// What holds for every law of material_list.inc at its typical parameters, at several deformations.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "estimator/materials/file_law.hpp"
#include "estimator/materials/reinforced_law.hpp"
#include "tests/estimator/materials/allocation_count.hpp"

namespace diastole {
namespace {

using Tensor = SymmetricTensor<double>;

constexpr Tensor rest{1.0, 1.0, 1.0, 0.0, 0.0, 0.0};

std::vector<double> typical_values(const Law& law) {
  std::vector<double> values;
  for (const LawParameter& parameter : law.parameters())
    values.push_back(parameter.typical);
  return values;
}

std::vector<Eigen::Matrix3d> deformations() {
  Eigen::Matrix3d general;
  general << 1.12, 0.08, -0.05, 0.03, 0.95, 0.11, -0.04, 0.06, 1.02;
  Eigen::Matrix3d along_fibre = Eigen::Vector3d(1.2, 1.0 / std::sqrt(1.2), 1.0 / std::sqrt(1.2)).asDiagonal();
  Eigen::Matrix3d short_fibre = Eigen::Vector3d(0.9, 1.1, 1.0 / 0.99).asDiagonal();
  // No stretch is exactly one, where tension-only fibres have a kink.
  Eigen::Matrix3d shear = Eigen::Vector3d(1.02, 0.97, 1.01).asDiagonal();
  shear(0, 2) = 0.25;
  // Two principal stretches that differ by 1e-7: neither equal nor well apart.
  Eigen::Matrix3d nearly_equal = Eigen::Vector3d(1.1, 1.1 + 1e-7, 1.0 / 1.21).asDiagonal();
  return {general, along_fibre, short_fibre, shear, nearly_equal};
}

Tensor right_cauchy_green(const Eigen::Matrix3d& f) { return symmetric_part(f.transpose() * f); }

class EveryLaw : public ::testing::TestWithParam<const Law*> {
 protected:
  const Law& law = *GetParam();
  std::vector<double> values = typical_values(law);

  double stiffness_kPa(const Tensor& c) const { return law.dual_response(c, values).tangent.norm() + 1.0; }
};

constexpr double weight(size_t m) { return m < 3 ? 2.0 : 1.0; }

TEST_P(EveryLaw, StressIsTheEnergysDerivative) {
  constexpr double step = 1e-5;
  for (const Eigen::Matrix3d& f : deformations()) {
    const Tensor c = right_cauchy_green(f);
    const Tensor stress = law.dual_response(c, values).stress;
    for (size_t m = 0; m < 6; ++m) {
      Tensor more = c;
      Tensor less = c;
      more[m] += step;
      less[m] -= step;
      const double slope = (law.energy(more, values) - law.energy(less, values)) / (2.0 * step);
      EXPECT_NEAR(stress[m], weight(m) * slope, 1e-7 * stiffness_kPa(c)) << "entry " << m << "\nF =\n" << f;
    }
  }
}

TEST_P(EveryLaw, TangentIsTheStresssDerivativeAndSymmetric) {
  constexpr double step = 1e-6;
  for (const Eigen::Matrix3d& f : deformations()) {
    const Tensor c = right_cauchy_green(f);
    const TangentTensor tangent = law.dual_response(c, values).tangent;
    const double scale = stiffness_kPa(c);
    EXPECT_LE((tangent - tangent.transpose()).norm(), 1e-12 * scale);
    for (size_t n = 0; n < 6; ++n) {
      Tensor more = c;
      Tensor less = c;
      more[n] += step;
      less[n] -= step;
      const Tensor high = law.dual_response(more, values).stress;
      const Tensor low = law.dual_response(less, values).stress;
      for (size_t m = 0; m < 6; ++m) {
        const double slope = weight(n) * (high[m] - low[m]) / (2.0 * step);
        EXPECT_NEAR(tangent(static_cast<int>(m), static_cast<int>(n)), slope, 2e-5 * scale)
            << "entry " << m << ", " << n << "\nF =\n"
            << f;
      }
    }
  }
}

TEST_P(EveryLaw, NeedsAxesIfTurningTheMaterialChangesTheEnergy) {
  double change = 0.0;
  double most = 0.0;
  std::vector<Eigen::Matrix3d> all = deformations();
  all.emplace_back(Eigen::Vector3d(1.3, 1.0 / std::sqrt(1.3), 1.0 / std::sqrt(1.3)).asDiagonal());
  for (const Eigen::Matrix3d& f : all) {
    const double energy = law.energy(right_cauchy_green(f), values);
    most = std::max(most, std::abs(energy));
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
      change = std::max(change, std::abs(law.energy(right_cauchy_green(f * turn), values) - energy));
    }
  }
  EXPECT_EQ(law.needs_axes(), change > 1e-6 * most) << change << " of " << most << " kPa";
}

TEST_P(EveryLaw, FastPathAgreesWithTheDualNumbers) {
  std::vector<Eigen::Matrix3d> all = deformations();
  all.push_back(Eigen::Matrix3d::Identity());
  for (const Eigen::Matrix3d& f : all) {
    const Tensor c = right_cauchy_green(f);
    const double scale = stiffness_kPa(c);
    const MaterialResponse dual = law.dual_response(c, values);
    const MaterialResponse response = law.response(c, values);
    const Tensor stress = law.stress(c, values);
    EXPECT_LE((response.tangent - dual.tangent).norm(), 1e-12 * scale);
    for (size_t m = 0; m < 6; ++m) {
      EXPECT_NEAR(response.stress[m], dual.stress[m], 1e-12 * scale);
      EXPECT_NEAR(stress[m], dual.stress[m], 1e-12 * scale);
    }
    for (size_t i = 0; i < values.size(); ++i) {
      const Tensor fast = law.stress_sensitivity(c, values, i);
      const Tensor by_duals = law.dual_stress_sensitivity(c, values, i);
      for (size_t m = 0; m < 6; ++m)
        EXPECT_NEAR(fast[m], by_duals[m], 1e-12 * (scale + std::abs(by_duals[m])));
    }
  }
}

TEST_P(EveryLaw, SensitivityIsTheStresssParameterDerivative) {
  for (const Eigen::Matrix3d& f : deformations()) {
    const Tensor c = right_cauchy_green(f);
    for (size_t i = 0; i < values.size(); ++i) {
      const double step = 1e-5 * std::abs(values[i]);
      std::vector<double> more = values;
      std::vector<double> less = values;
      more[i] += step;
      less[i] -= step;
      const Tensor high = law.stress(c, more);
      const Tensor low = law.stress(c, less);
      const Tensor slope = law.dual_stress_sensitivity(c, values, i);
      for (size_t m = 0; m < 6; ++m) {
        EXPECT_NEAR(slope[m] * values[i], values[i] * (high[m] - low[m]) / (2.0 * step),
                    1e-8 * stiffness_kPa(c))
            << law.parameters()[i].name << ", entry " << m;
      }
    }
  }
}

TEST_P(EveryLaw, StressIsProportionalToAllModuliTogether) {
  std::vector<double> stiffer = values;
  for (size_t i = 0; i < values.size(); ++i)
    if (law.parameters()[i].is_modulus()) stiffer[i] *= 3.0;
  for (const Eigen::Matrix3d& f : deformations()) {
    const Tensor c = right_cauchy_green(f);
    for (size_t m = 0; m < 6; ++m)
      EXPECT_NEAR(law.stress(c, stiffer)[m], 3.0 * law.stress(c, values)[m], 1e-12 * stiffness_kPa(c));
  }
}

TEST_P(EveryLaw, RestIsFreeOfEnergyAndOfDeviatoricStress) {
  EXPECT_NEAR(law.energy(rest, values), 0.0, 1e-12 * stiffness_kPa(rest));
  const Tensor stress = law.stress(rest, values);
  const double mean = trace(stress) / 3.0;
  for (size_t m = 0; m < 6; ++m)
    EXPECT_NEAR(stress[m], m < 3 ? mean : 0.0, 1e-12 * stiffness_kPa(rest));
}

TEST_P(EveryLaw, DistortionCostsEnergy) {
  for (const Eigen::Matrix3d& f : deformations()) {
    const Eigen::Matrix3d isochoric = f / std::cbrt(f.determinant());
    EXPECT_GT(law.energy(right_cauchy_green(isochoric), values), 0.0) << f;
  }
}

TEST_P(EveryLaw, FrameIndifferent) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  for (const Eigen::Matrix3d& f : deformations()) {
    const double still = law.energy(right_cauchy_green(f), values);
    EXPECT_NEAR(law.energy(right_cauchy_green(turn * f), values), still, 1e-11 * stiffness_kPa(rest));
  }
}

TEST_P(EveryLaw, EvaluatesWithoutAllocating) {
  const Tensor c = right_cauchy_green(deformations().front());
  double sum = law.energy(c, values);  // static tables may be made by a first call
  const size_t before = allocation_count();
  sum += law.energy(c, values) + law.stress(c, values)[0] + law.response(c, values).stress[0] +
         law.dual_response(c, values).stress[0] + law.stress_sensitivity(c, values, 0)[0];
  EXPECT_EQ(allocation_count(), before) << sum;
}

TEST_P(EveryLaw, NamesAreUniqueAndFound) {
  if (law.name().starts_with("my-") || law.name().starts_with("reinforced-")) {
    EXPECT_EQ(find_law(law.name()), nullptr);  // of a file, or made of another law
  } else {
    EXPECT_EQ(find_law(law.name()), &law);
  }
  for (size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(law.parameter_index(law.parameters()[i].name), i);
    EXPECT_GT(values[i], law.parameters()[i].above);
  }
}

std::string test_name(const ::testing::TestParamInfo<const Law*>& info) {
  std::string name(info.param->name());
  for (char& c : name) {
    if (c == '-') c = '_';
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(List, EveryLaw, ::testing::ValuesIn(all_laws()), test_name);

/// Those of examples/laws.
std::vector<const Law*> laws_of_files() {
  std::vector<const Law*> laws;
  for (const auto& entry : std::filesystem::directory_iterator(DIASTOLE_SOURCE_DIR "/examples/laws"))
    laws.push_back(&law_of_file(entry.path()));
  return laws;
}

INSTANTIATE_TEST_SUITE_P(Files, EveryLaw, ::testing::ValuesIn(laws_of_files()), test_name);

/// Fibres that bear nothing at the strains of most of these tests.
const Law& recruited_fibres() {
  static const std::unique_ptr<const Law> law = read_law_text(R"toml(
format = "diastole-law"
version = 1
id = "my-recruited-fibres"
energy_kPa = "c * (I1 - 3) + if(lambda_f > straight, k * (lambda_f - straight)^2, 0)"
[[parameter]]
name = "c"
unit = "kPa"
bounds = [0, 100]
typical = 3
[[parameter]]
name = "k"
unit = "kPa"
bounds = [0, 500]
typical = 40
[[parameter]]
name = "straight"
bounds = [1, 1.6]
typical = 1.22
)toml",
                                                              "my-recruited-fibres.law.toml");
  return *law;
}

INSTANTIATE_TEST_SUITE_P(OfLargeStrains, EveryLaw, ::testing::Values(&recruited_fibres()), test_name);

INSTANTIATE_TEST_SUITE_P(Reinforced, EveryLaw,
                         ::testing::Values(&reinforced(*find_law("guccione")),
                                           &reinforced(*find_law("neo-hookean"))),
                         test_name);

}  // namespace
}  // namespace diastole
