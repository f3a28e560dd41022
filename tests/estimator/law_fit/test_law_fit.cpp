#include "estimator/law_fit/law_fit.hpp"

#include <gmock/gmock.h>

#include "estimator/law_fit/law_comparison.hpp"
#include "estimator/materials/file_law.hpp"
#include "estimator/shear/shear_fit.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/estimator/law_fit/made_tests.hpp"
#include "tests/estimator/shear/synthetic_shear.hpp"

namespace diastole {
namespace {

using test::gel;
using test::MadeTests;
using testing::HasSubstr;
using Tests = std::vector<BenchTest>;

const Law& law(std::string_view name) { return *find_law(name); }

double value(const LawFit& fit, size_t parameter) { return fit.parameters.at(parameter).value; }

TEST(LawFit, FindsTheLawThatMadeTheTests) {
  MadeTests made;
  const Tests each{made.uniaxial(), made.equibiaxial(), made.torsion(), made.tube()};
  for (const BenchTest& test : each) {
    const LawFit fit = fit_law(law("mooney-rivlin"), Tests{test});
    EXPECT_TRUE(fit.determined()) << test.file << " " << fit.reason;
    EXPECT_NEAR(value(fit, 0), gel.C1_kPa, 1e-6) << test.file;
    EXPECT_NEAR(value(fit, 1), gel.C2_kPa, 1e-6) << test.file;
    EXPECT_LT(fit.error_percent, 1e-6) << test.file;
  }
  const LawFit all = fit_law(law("mooney-rivlin"), each);
  EXPECT_NEAR(value(all, 0), gel.C1_kPa, 1e-6);
  EXPECT_EQ(all.channels.size(), 1U + 2 + 2 + 1);
}

TEST(LawFit, ALawOfAFileIsFittedAlike) {
  MadeTests made(0.02);
  const Tests tests{made.uniaxial(), made.tube()};
  const LawFit built_in = fit_law(law("mooney-rivlin"), tests);
  const LawFit of_file =
      fit_law(law_of_file(DIASTOLE_SOURCE_DIR "/examples/laws/mooney-rivlin.law.toml"), tests);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(value(of_file, i), value(built_in, i), 1e-5 * value(built_in, i));
    EXPECT_NEAR(of_file.parameters[i].se, built_in.parameters[i].se, 1e-4 * built_in.parameters[i].se);
  }
}

/// The file and the estimate of `diastole shear`, in its form for equal errors of all rotations.
TEST(LawFit, TheRotationalShearTestIsOneOfThem) {
  const ShearTest shear = test::synthetic_shear(0.07, 5);
  const ShearFit line = fit_shear(shear, ShearForm::rotation);
  std::string text = "inner_radius_mm,outer_radius_mm,height_mm,moment_Nmm,radius_mm,rotation_deg\n";
  for (const ShearRow& row : shear.rows) {
    text += fmt::format("8,19,24,{},{},{}\n", row.moment_Nmm, row.radius_mm,
                        row.rotation_rad * 180 / std::numbers::pi);
  }
  const LawFit fit = fit_law(law("neo-hookean"), Tests{bench_test_from_text(text, "shear.csv")});
  EXPECT_NEAR(value(fit, 0), line.C1_kPa, 1e-6 * line.C1_kPa);
  EXPECT_NEAR(fit.parameters[0].se, line.se_kPa, 1e-3 * line.se_kPa);
}

/// In a plane strain I1 = I2: such tests know C1 + C2 alone, whatever their noise.
TEST(LawFit, NamesTheCombinationThatIsNotDetermined) {
  for (const double noise : {0.0, 0.01}) {
    MadeTests made(noise);
    Tests tests{made.planar(), made.simple_shear()};
    const LawFit plane = fit_law(law("mooney-rivlin"), tests);
    EXPECT_TRUE(plane.settled) << plane.reason;
    EXPECT_FALSE(plane.determined());
    ASSERT_EQ(plane.undetermined.size(), 1U);
    EXPECT_TRUE(std::isinf(plane.undetermined[0].sd_percent));
    ASSERT_EQ(plane.undetermined[0].change_percent.size(), 2U);
    double change_kPa = 0;
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_TRUE(std::isinf(plane.parameters[i].se));
      change_kPa += plane.undetermined[0].change_percent[i].second * value(plane, i);
    }
    EXPECT_NEAR(change_kPa, 0, 1e-6);
    EXPECT_NEAR(value(plane, 0) + value(plane, 1), gel.C1_kPa + gel.C2_kPa, 0.1);
    tests.push_back(made.equibiaxial());
    EXPECT_TRUE(fit_law(law("mooney-rivlin"), tests).determined());
  }
}

/// What the noise hides is not determined either, though the Jacobian has full rank.
TEST(LawFit, ACombinationThatIsLostInNoiseIsNamed) {
  int named = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    MadeTests made(0.1, seed);
    BenchTest small = made.uniaxial();
    std::erase_if(small.readings, [](const Reading& reading) { return reading.controls[0] > 1.3; });
    const LawFit fit = fit_law(law("mooney-rivlin"), Tests{small});
    for (const Undetermined& combination : fit.undetermined) {
      EXPECT_TRUE(std::isfinite(combination.sd_percent));
      EXPECT_GT(combination.sd_percent, 50);
      ++named;
    }
  }
  EXPECT_GT(named, 0);
}

TEST(LawFit, IntervalsHoldTheTruthAsOftenAsTheySay) {
  constexpr int trials = 200;
  int held = 0;
  for (unsigned seed = 1; seed <= trials; ++seed) {
    // Errors as the fit takes them: the same for each reading of a column.
    MadeTests made;
    Tests tests{made.uniaxial(), made.equibiaxial()};
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 0.02);
    for (BenchTest& test : tests)
      for (Reading& reading : test.readings)
        for (size_t i = 0; i < reading.measured.size(); ++i)
          reading.measured[i] += test.channels[i].rms * normal(random);
    const LawFit fit = fit_law(law("mooney-rivlin"), tests);
    held += fit.parameters[1].ci95[0] < gel.C2_kPa && gel.C2_kPa < fit.parameters[1].ci95[1] ? 1 : 0;
  }
  // 95 % of 200 and three standard deviations of the binomial distribution.
  EXPECT_NEAR(held, 190, 9.3);
}

TEST(LawFit, ATermThatTheDataDoNotAskForRestsOnItsBound) {
  MadeTests made;
  const test::Mooney softening{8, -0.5};
  const LawFit fit =
      fit_law(law("mooney-rivlin"), Tests{made.uniaxial(softening), made.equibiaxial(softening)});
  EXPECT_TRUE(fit.settled) << fit.reason;
  EXPECT_EQ(fit.parameters[1].bound, inference::BoundSide::lower);
  EXPECT_NEAR(value(fit, 1), 0, 1e-3);
  EXPECT_THAT(fit.remarks, testing::Contains(HasSubstr("C2_kPa rests on its bound")));
}

TEST(LawFit, AValueBeyondAFilesUpperBoundRestsOnIt) {
  const test::ScratchFolder folder;
  const auto soft = read_law_file(folder.write("soft.law.toml", R"toml(
format = "diastole-law"
version = 1
id = "soft"
energy_kPa = "c * (I1 - 3) + d * (I2 - 3)"
[[parameter]]
name = "c"
unit = "kPa"
bounds = [0, 5]
typical = 2
[[parameter]]
name = "d"
unit = "kPa"
bounds = [0, 100]
typical = 2
)toml"));
  MadeTests made;
  const LawFit fit = fit_law(*soft, Tests{made.uniaxial()});
  EXPECT_EQ(fit.parameters[0].bound, inference::BoundSide::upper);
  EXPECT_NEAR(value(fit, 0), 5.0, 1e-9);
  EXPECT_LE(fit.parameters[0].ci95[1], 5.0);
  EXPECT_THAT(fit.remarks, testing::Contains(HasSubstr("these data ask for more")));
}

TEST(LawFit, SaysThatALawMissesTheCurve) {
  MadeTests made(0.002);
  const Tests tests{made.uniaxial()};
  EXPECT_THAT(fit_law(law("neo-hookean"), tests).remarks, testing::Contains(HasSubstr("follow one another")));
  EXPECT_TRUE(fit_law(law("mooney-rivlin"), tests).remarks.empty());
}

TEST(LawFit, FindsAStiffeningLawFromAfar) {
  std::string text = "stretch_1,stretch_2,nominal_1_kPa,nominal_2_kPa\n";
  const double C1 = 2.5, beta = 0.4;  // the law's typical ones: 0.165 and 9.242
  for (double l = 1.1; l < 2.05; l += 0.1) {
    const double I1 = 2 * l * l + std::pow(l, -4);
    const double nominal_kPa = 2 * C1 * std::exp(beta * (I1 - 3)) * (l - std::pow(l, -5));
    text += fmt::format("{},{},{},{}\n", l, l, nominal_kPa, nominal_kPa);
  }
  const LawFit fit = fit_law(law("demiray"), Tests{bench_test_from_text(text, "stiffening.csv")});
  EXPECT_TRUE(fit.determined()) << fit.reason;
  EXPECT_NEAR(value(fit, 0), C1, 1e-4);
  EXPECT_NEAR(value(fit, 1), beta, 1e-4);
}

TEST(LawFit, RefusesWhatTheTestsCannotTell) {
  MadeTests made;
  const Tests tests{made.uniaxial()};
  EXPECT_THAT(test::message_of([&] { check_law(law("guccione"), tests); }),
              HasSubstr("where the fibre lies"));
  BenchTest few = made.uniaxial();
  few.readings.resize(5);
  EXPECT_THAT(test::message_of([&] { check_law(law("ogden"), Tests{few}); }),
              HasSubstr("6 parameters, and there are 5"));
  EXPECT_EQ(why_not(law("mooney-rivlin"), tests), "");
}

TEST(LawComparison, PrefersTheLawThatPredictsOtherKindsOfTests) {
  MadeTests made(0.01);
  const Tests tests{made.uniaxial(), made.equibiaxial(), made.torsion()};
  const std::vector<const Law*> laws{&law("neo-hookean"), &law("mooney-rivlin"), &law("demiray")};
  const LawComparison comparison = compare_laws(laws, tests);
  EXPECT_TRUE(comparison.over_kinds);
  EXPECT_THAT(comparison.folds, testing::ElementsAre("uniaxial", "biaxial", "torsion"));
  ASSERT_TRUE(comparison.preferred);
  const ComparedLaw& best = comparison.laws[*comparison.preferred];
  EXPECT_EQ(best.fit.law->name(), "mooney-rivlin");
  EXPECT_LT(best.predicted_percent, 3);
  for (const ComparedLaw& other : comparison.laws) {
    if (&other == &best) continue;
    EXPECT_TRUE(other.distinguished);
    EXPECT_GT(other.predicted_percent, 3 * best.predicted_percent) << other.fit.law->name();
  }
}

TEST(LawComparison, TakesTheSimplerOfTwoThatPredictAlike) {
  MadeTests made(0.02, 3);
  const test::Mooney plain{8.71, 0};
  const Tests tests{made.uniaxial(plain), made.equibiaxial(plain), made.simple_shear(plain)};
  const std::vector<const Law*> laws{&law("mooney-rivlin"), &law("neo-hookean")};
  const LawComparison comparison = compare_laws(laws, tests);
  ASSERT_TRUE(comparison.preferred);
  EXPECT_EQ(comparison.laws[*comparison.preferred].fit.law->name(), "neo-hookean");
}

TEST(LawComparison, OneKindOfTestIsDividedByReadings) {
  MadeTests made(0.01);
  const std::vector<const Law*> laws{&law("neo-hookean"), &law("mooney-rivlin")};
  const LawComparison comparison = compare_laws(laws, {made.uniaxial()});
  EXPECT_FALSE(comparison.over_kinds);
  EXPECT_EQ(comparison.folds.size(), 5U);
  EXPECT_EQ(comparison.laws[*comparison.preferred].fit.law->name(), "mooney-rivlin");
}

/// The tests that are left do not determine the law: its prediction says so.
TEST(LawComparison, SaysWhatTheOtherTestsDoNotDetermine) {
  MadeTests made(0.01);
  const std::vector<const Law*> laws{&law("mooney-rivlin")};
  const LawComparison comparison = compare_laws(laws, {made.planar(), made.equibiaxial()});
  ASSERT_THAT(comparison.folds, testing::ElementsAre("planar", "biaxial"));
  EXPECT_TRUE(comparison.laws[0].left_out[0].determined);
  EXPECT_FALSE(comparison.laws[0].left_out[1].determined);
}

TEST(LawComparison, EndsOnRequest) {
  MadeTests made(0.01);
  const std::vector<const Law*> laws{&law("mooney-rivlin")};
  ComparisonOptions options;
  options.interrupted = [] { return true; };
  EXPECT_TRUE(compare_laws(laws, {made.uniaxial()}, options).laws.empty());
}

}  // namespace
}  // namespace diastole
