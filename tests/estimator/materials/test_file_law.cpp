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
    EXPECT_EQ(law.parameters()[i].unit, expected.parameters()[i].unit);
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

std::string parameter(const std::string& name, const std::string& unit) {
  return "[[parameter]]\nname = \"" + name + "\"\nunit = \"" + unit + "\"\nbounds = [0, 10]\ntypical = 5\n";
}

struct LawText {
  std::string energy = "C1_kPa * (I1 - 3)";
  std::string id = "x";
  std::string parameters = parameter("C1_kPa", "kPa");
};

std::unique_ptr<const Law> law_of(const LawText& law) {
  return read_law_text("format = \"diastole-law\"\nversion = 1\nid = \"" + law.id + "\"\nenergy_kPa = \"" +
                           law.energy + "\"\n" + law.parameters,
                       "x.law.toml");
}

InputFault fault_of(const LawText& law) {
  try {
    law_of(law);
  } catch (const InputError& error) {
    return error.fault();
  }
  ADD_FAILURE() << law.energy << " is read";
  return {};
}
InputFault fault_of(const std::string& energy) { return fault_of(LawText{.energy = energy}); }

TEST(FileLaw, RefusesAnEnergyThatIsNoPressure) {
  EXPECT_EQ(fault_of("C1_kPa * C1_kPa * (I1 - 3)").place, "line 4, column 15, key energy_kPa");
  EXPECT_FALSE(fault_of("I1 - 3").problem.empty());
  EXPECT_FALSE(fault_of("C1_kPa * (I1 - C1_kPa)").problem.empty());
  EXPECT_FALSE(fault_of("C1_kPa * (I9 - 3)").problem.empty());
}

TEST(FileLaw, NeedsAxesIfItsEnergyReadsADirection) {
  const std::string matrix = "C1_kPa * (I1 - 3)";
  for (const char* more : {"if(lambda_f > 3, (lambda_f - 3)^2, 0)", "max(I4s - 7, 0)^2", "I8fs^2", "Eff^2",
                           "Esr^2", "(Cnn - 1)^2"})
    EXPECT_TRUE(law_of({.energy = matrix + " + C1_kPa * " + more})->needs_axes()) << more;
  for (const char* more : {"(I1 - 3)^2", "(I2 - 3)", "exp(I1 - 3) * (I3 - 1)^2", "0 * I4f"})
    EXPECT_FALSE(law_of({.energy = matrix + " + C1_kPa * " + more})->needs_axes()) << more;
}

TEST(FileLaw, RefusesWhatNoBodyCanBeMadeOf) {
  for (const auto& [energy, problem] :
       {std::pair{"-C1_kPa * (I1 - 3)", "falls"}, std::pair{"C1_kPa * (I3 - 1)^2", "costs nothing"},
        std::pair{"C1_kPa / (I1 - 3)", "not finite"}, std::pair{"C1_kPa * log(I1 - 3)", "not finite"},
        std::pair{"C1_kPa * sqrt(I1 - 3)", "not finite"},
        std::pair{"C1_kPa * (I4f - 1)", "10, 0, 0, 0, 0, 0"}}) {
    const InputFault fault = fault_of(energy);
    EXPECT_EQ(fault.place, "line 4, column 15, key energy_kPa") << energy;
    EXPECT_NE(fault.problem.find(problem), std::string::npos) << fault.problem;
    EXPECT_FALSE(fault.remedy.empty()) << energy;
  }
  EXPECT_EQ(fault_of("C1_kPa * (I1 - 3) / (1 - 1)").place, "line 4, column 35, key energy_kPa");
}

TEST(FileLaw, StatesUnitsAndBounds) {
  const auto law =
      law_of({.energy = "c * (I1 - 3)^n", .parameters = parameter("c", "kPa^2 / kPa") + parameter("n", "1")});
  EXPECT_TRUE(law->parameters()[0].is_modulus());
  EXPECT_FALSE(law->parameters()[1].is_modulus());
  EXPECT_EQ(law->parameters()[0].at_most, 10.0);
  const InputFault fault = fault_of({.energy = "c * (I1 - 3)", .parameters = parameter("c", "Pa")});
  EXPECT_EQ(fault.place, "line 7, key parameter[0].unit");
}

TEST(FileLaw, RefusesAnIdThatIsNone) {
  for (const char* id : {"", "Gel \u00BD <b>x</b>", "mooney-rivlin"})
    EXPECT_EQ(fault_of(LawText{.id = id}).place, "line 3, key id") << id;
}

TEST(FileLaw, RefusesAParameterThatItDoesNotUse) {
  const InputFault fault = fault_of({.parameters = parameter("C1_kPa", "kPa") + parameter("D", "kPa")});
  EXPECT_EQ(fault.place, "line 11, key parameter[1].name");
}

}  // namespace
}  // namespace diastole
