// Laws of files against those that are built in, and what a file may not say.

#include "estimator/materials/file_law.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

struct Pair {
  const char* built_in;
  const char* file;
};

class LawOfAFile : public testing::TestWithParam<Pair> {};

TEST_P(LawOfAFile, AgreesWithTheBuiltInOne) {
  const Law& expected = *find_law(GetParam().built_in);
  const Law& law = law_of_file(std::string(DIASTOLE_SOURCE_DIR "/examples/laws/") + GetParam().file);
  ASSERT_EQ(law.parameters().size(), expected.parameters().size());
  EXPECT_EQ(law.needs_axes(), expected.needs_axes());
  std::vector<double> values;
  for (size_t i = 0; i < law.parameters().size(); ++i) {
    EXPECT_EQ(law.parameters()[i].name, expected.parameters()[i].name);
    EXPECT_EQ(law.parameters()[i].typical, expected.parameters()[i].typical);
    values.push_back(expected.parameters()[i].typical);
  }
  constexpr double same = 1e-12;
  for (const SymmetricTensor<double>& c : {SymmetricTensor<double>{1.21, 0.93, 1.06, 0.11, -0.07, 0.05},
                                           {0.9, 1.1, 1.0, -0.2, 0.03, 0.1},
                                           {1.4, 0.85, 0.87, 0.02, 0.01, -0.04}}) {
    const MaterialResponse a = law.response(c, values);
    const MaterialResponse b = expected.response(c, values);
    const double scale = b.tangent.norm();
    EXPECT_NEAR(law.energy(c, values), expected.energy(c, values), same * scale);
    EXPECT_LE((a.tangent - b.tangent).norm(), same * scale);
    for (size_t m = 0; m < 6; ++m)
      EXPECT_NEAR(a.stress[m], b.stress[m], same * scale);
    for (size_t i = 0; i < values.size(); ++i)
      for (size_t m = 0; m < 6; ++m)
        EXPECT_NEAR(law.stress_sensitivity(c, values, i)[m], expected.stress_sensitivity(c, values, i)[m],
                    same * scale);
  }
}

INSTANTIATE_TEST_SUITE_P(Examples, LawOfAFile,
                         testing::Values(Pair{"mooney-rivlin", "mooney-rivlin.law.toml"},
                                         Pair{"guccione", "guccione.law.toml"},
                                         Pair{"holzapfel-ogden", "holzapfel-ogden.law.toml"}),
                         [](const auto& pair) {
                           std::string name = pair.param.built_in;
                           std::erase(name, '-');
                           return name;
                         });

InputFault fault_of(const std::string& energy) {
  try {
    read_law_text("format = \"diastole-law\"\nversion = 1\nid = \"x\"\nenergy_kPa = \"" + energy +
                      "\"\n[[parameter]]\nname = \"C1_kPa\"\nunit = \"kPa\"\nbounds = [0, 10]\ntypical = 5\n",
                  "x.law.toml");
  } catch (const InputError& error) {
    return error.fault();
  }
  ADD_FAILURE() << energy << " is read";
  return {};
}

TEST(FileLaw, RefusesAnEnergyThatIsNoPressure) {
  EXPECT_EQ(fault_of("C1_kPa * C1_kPa * (I1 - 3)").place, "line 4, column 15, key energy_kPa");
  EXPECT_FALSE(fault_of("I1 - 3").problem.empty());
  EXPECT_FALSE(fault_of("C1_kPa * (I1 - C1_kPa)").problem.empty());
  EXPECT_FALSE(fault_of("C1_kPa * (I9 - 3)").problem.empty());
}

}  // namespace
}  // namespace diastole
