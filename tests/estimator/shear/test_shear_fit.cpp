#include <gmock/gmock.h>

#include "estimator/shear/shear_fit.hpp"
#include "tests/estimator/shear/synthetic_shear.hpp"

namespace diastole {
namespace {

using test::synthetic_shear;
using test::true_C1_kPa;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr double camera_noise_deg = 0.07;  // about 0.02 mm, a pixel of a 4-megapixel camera over the annulus

TEST(ShearFit, IsExactWithoutNoise) {
  for (const ShearForm form : {ShearForm::normalised, ShearForm::rotation}) {
    const ShearFit fit = fit_shear(synthetic_shear(0, 1), form);
    EXPECT_TRUE(fit.determined);
    EXPECT_NEAR(fit.C1_kPa, true_C1_kPa, 1e-11);
    EXPECT_NEAR(fit.se_kPa, 0, 1e-11);
    EXPECT_NEAR(fit.swapped_C1_kPa, true_C1_kPa, 1e-11);
    EXPECT_NEAR(fit.r2, 1, 1e-14);
    EXPECT_THAT(fit.remarks, IsEmpty());
    EXPECT_THAT(fit.loads, SizeIs(4));
  }
}

// Equilibrium, integrated numerically: omega' = M / (2 pi h r^3 * shear modulus), shear modulus 2 C1. Independent
// of the closed form.
TEST(ShearFit, AgreesWithTheIntegratedEquilibrium) {
  const double moment_Nmm = 30, modulus_MPa = 2 * true_C1_kPa / 1000;
  ShearTest integrated = {"", "moment_Nmm", {}};
  double rotation_rad = 0;
  const int steps = 11000;
  for (int i = 0; i < steps; ++i) {
    const double dr_mm = 11.0 / steps, r_mm = 8 + (i + 0.5) * dr_mm;
    rotation_rad += dr_mm * moment_Nmm / (2 * M_PI * 24 * std::pow(r_mm, 3) * modulus_MPa);
    if (i % 1000 == 999) {
      integrated.rows.push_back({test::paper_annulus, moment_Nmm, r_mm + dr_mm / 2, rotation_rad, 0});
    }
  }
  EXPECT_NEAR(fit_shear(integrated).C1_kPa, true_C1_kPa, 1e-6);
}

TEST(ShearFit, RecoversThePapersFigureWithItsError) {
  const ShearFit fit = fit_shear(synthetic_shear(camera_noise_deg, 1));
  EXPECT_NEAR(fit.C1_kPa, true_C1_kPa, 3 * fit.se_kPa);
  EXPECT_LE(fit.se_kPa, 0.06);
  EXPECT_GE(fit.se_kPa, 0.03);
  EXPECT_GT(fit.r2, 0.997);
  EXPECT_LT(fit.r2_about_mean, fit.r2);
  EXPECT_NEAR(fit.swapped_C1_kPa, fit.r2 * fit.C1_kPa, 1e-12);
  EXPECT_NEAR(fit.rms_deg, camera_noise_deg, 0.3 * camera_noise_deg);
}

TEST(ShearFit, RadiansInPlaceOfDegreesAndRepeatedRowsAreRemarked) {
  ShearTest radians = synthetic_shear(camera_noise_deg, 1);
  for (ShearRow& row : radians.rows)
    row.rotation_rad *= std::numbers::pi / 180;
  EXPECT_THAT(fit_shear(radians).remarks, Contains(HasSubstr("rotations are in degrees")));
  ShearTest twice = synthetic_shear(camera_noise_deg, 1);
  EXPECT_THAT(fit_shear(twice).remarks, IsEmpty());
  twice.rows.insert(twice.rows.end(), twice.rows.begin(), twice.rows.begin() + 20);
  EXPECT_THAT(fit_shear(twice).remarks, Contains(HasSubstr("20 of 80 rows repeat another")));
}

// Every rotation has the same error, so the normalised form's small loads scatter most: the interval must hold
// in both forms, and the rotation form must be the sharper one.
TEST(ShearFit, TheIntervalHoldsTheTruthAtItsRate) {
  constexpr int repeats = 2000;
  double mean_se[2] = {}, mean_C1[2] = {};
  for (const ShearForm form : {ShearForm::normalised, ShearForm::rotation}) {
    int inside = 0;
    const int which = form == ShearForm::rotation;
    for (unsigned seed = 1; seed <= repeats; ++seed) {
      const ShearFit fit = fit_shear(synthetic_shear(camera_noise_deg, seed), form);
      inside += fit.ci95_kPa[0] <= true_C1_kPa && true_C1_kPa <= fit.ci95_kPa[1];
      mean_se[which] += fit.se_kPa / repeats;
      mean_C1[which] += fit.C1_kPa / repeats;
    }
    const double coverage = static_cast<double>(inside) / repeats;
    RecordProperty(which ? "coverage_rotation" : "coverage_normalised", std::to_string(coverage));
    EXPECT_GE(coverage, 0.93);
    EXPECT_LE(coverage, 0.97);
    EXPECT_NEAR(mean_C1[which], true_C1_kPa, 0.005);
  }
  EXPECT_LT(mean_se[1], 0.75 * mean_se[0]);
  EXPECT_LE(mean_se[0], 0.06);
}

TEST(ShearFit, FindsAMistrackedMarkerAndSeldomAnotherOne) {
  int false_alarms = 0;
  for (unsigned seed = 1; seed <= 200; ++seed)
    false_alarms += !fit_shear(synthetic_shear(camera_noise_deg, seed)).outliers.empty();
  EXPECT_LE(false_alarms, 22);  // 5 % of the files, and three standard deviations

  ShearTest test = synthetic_shear(camera_noise_deg, 3);
  test.rows[40].rotation_rad += 0.6 * M_PI / 180;
  const ShearFit fit = fit_shear(test);
  ASSERT_THAT(fit.outliers, SizeIs(1));
  EXPECT_EQ(fit.outliers[0].line, 42U);
  EXPECT_NEAR(fit.outliers[0].residual_deg, 0.6, 0.25);
  EXPECT_THAT(fit.remarks, Contains(HasSubstr("Line 42 ")));
}

TEST(ShearFit, SaysWhichLoadDisagrees) {
  ShearTest test = synthetic_shear(camera_noise_deg, 4);
  for (ShearRow& row : test.rows) {
    if (row.moment_Nmm == 28.5) row.moment_Nmm *= 1.2;
  }
  EXPECT_THAT(fit_shear(test).remarks, Contains(HasSubstr("at 34.2 N mm give")));
}

TEST(ShearFit, SaysThatTheBondSlips) {
  ShearTest test = synthetic_shear(camera_noise_deg, 5);
  for (ShearRow& row : test.rows)
    row.rotation_rad += 0.01 * row.moment_Nmm / 38;
  EXPECT_THAT(fit_shear(test).remarks, Contains(HasSubstr("misses the origin")));
  int false_alarms = 0;
  for (unsigned seed = 1; seed <= 200; ++seed)
    false_alarms += !fit_shear(synthetic_shear(camera_noise_deg, seed)).remarks.empty();
  EXPECT_LE(false_alarms, 24);
}

TEST(ShearFit, SaysThatAnnuliDiffer) {
  ShearTest test = synthetic_shear(0, 1);
  test.rows[7].annulus.height_mm = 12;
  test.rows[7].rotation_rad *= 2;
  const ShearFit fit = fit_shear(test);
  EXPECT_NEAR(fit.C1_kPa, true_C1_kPa, 1e-11);
  EXPECT_THAT(fit.remarks, Contains(HasSubstr("Line 9 has another annulus than line 2")));
}

TEST(ShearFit, IsNotDeterminedByRotationsAgainstTheLoadOrByScatterAlone) {
  ShearTest backwards = synthetic_shear(camera_noise_deg, 6);
  for (ShearRow& row : backwards.rows)
    row.rotation_rad *= -1;
  EXPECT_FALSE(fit_shear(backwards).determined);
  EXPECT_THAT(fit_shear(backwards).remarks, Contains(HasSubstr("against the load")));

  ShearTest clockwise = backwards;
  for (ShearRow& row : clockwise.rows)
    row.moment_Nmm *= -1;
  EXPECT_TRUE(fit_shear(clockwise).determined);

  const ShearFit lost = fit_shear(synthetic_shear(100, 7));
  EXPECT_FALSE(lost.determined);
}

TEST(OriginLine, AgreesWithHandCalculation) {
  const double x[] = {1, 2, 2}, y[] = {2, 3, 5};
  const OriginLine line = line_through_origin(x, y);
  EXPECT_DOUBLE_EQ(line.slope, 2);
  EXPECT_DOUBLE_EQ(line.sum_of_residuals2, 2);
  EXPECT_DOUBLE_EQ(line.se, 1.0 / 3);
}

TEST(OriginLine, TheInterceptAgreesWithHandCalculation) {
  const double x[] = {0, 1, 2}, y[] = {1, 1, 4};  // y = 0.5 + 1.5 x, residuals 0.5, -1, 0.5
  EXPECT_NEAR(intercept_deviations(x, y), 0.5 / std::sqrt(1.5 * (1.0 / 3 + 0.5)), 1e-12);
}

}  // namespace
}  // namespace diastole
