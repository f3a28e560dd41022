#include "estimator/fit/offset_score.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "estimator/fit/study_fit.hpp"
#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class Offset : public testing::Test {
 protected:
  static Measurement measured(double offset_kPa, unsigned seed, size_t tags = 300) {
    ElasticModel truth = test::coarse_gel(8.71);
    Measurement measurement = test::synthetic(
        truth, {.pressures_kPa = {0.6, 1.8, 3.0}, .tags_a_frame = tags, .sigma_mm = 0.1, .seed = seed});
    for (size_t frame = 1; frame < measurement.frames.size(); ++frame)
      measurement.frames[frame].pressure_kPa += offset_kPa;
    return measurement;
  }
  static FitRecord record(const Measurement& measurement) {
    Study study;
    study.file = "gel.study.toml";
    study.specimen = AnnulusSpecimen{22.5, 50, 85, {4, 2, 1}, "fixed"};
    study.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 15.0, Variation::whole}}};
    return fit_study(study, measurement, {});
  }
};

TEST_F(Offset, ASoundMeasurementScattersAsTheScoreSays) {
  double squares = 0;
  constexpr int repeats = 12;
  for (unsigned seed = 1; seed <= repeats; ++seed) {
    const FitOutcome fit = test::fit_C1(measured(0, seed, 80));
    ASSERT_TRUE(fit.offset_score);
    squares += std::pow(fit.offset_score->value_kPa / fit.offset_score->se_kPa, 2);
  }
  EXPECT_GT(squares / repeats, 0.37);  // 99 % of chi2 with 12 degrees of freedom
  EXPECT_LT(squares / repeats, 2.36);
}

TEST_F(Offset, OneThatTheDataSeeIsSaidWithWhatItDoes) {
  EXPECT_THAT(record(measured(0, 1)).remarks, Not(Contains(HasSubstr("--pressure-offset"))));
  for (const double offset_kPa : {0.2, -0.2}) {
    Measurement measurement = measured(offset_kPa, 1);
    const FitRecord found = record(measurement);
    EXPECT_THAT(found.remarks, Contains(AllOf(HasSubstr(offset_kPa > 0 ? "too high" : "too low"),
                                              HasSubstr("C1_kPa"), HasSubstr("--pressure-offset"))));
    const FitOutcome fit = test::fit_C1(measurement);
    ASSERT_TRUE(fit.offset_score);
    EXPECT_NEAR(fit.offset_score->value_kPa, offset_kPa, 4 * fit.offset_score->se_kPa);
    EXPECT_LT(std::abs(fit.offset_score->values[0] - 8.71), 0.5 * std::abs(fit.values[0].value - 8.71));
    for (Frame& frame : measurement.frames)
      frame.sigma_kPa = 0;  // known exactly: the motion alone tells
    const FitOutcome exact = test::fit_C1(measurement);
    ASSERT_TRUE(exact.offset_score);
    EXPECT_NEAR(exact.offset_score->value_kPa, offset_kPa, 0.06);
  }
}

TEST_F(Offset, AReadingAtRestMeasuresIt) {
  Measurement measurement = measured(0.05, 1, 80);
  const FitOutcome without = test::fit_C1(measurement);
  measurement.frames[0].pressure_kPa = 0.05;
  measurement.frames[0].sigma_kPa = 0.005;
  const FitOutcome with = test::fit_C1(measurement);
  ASSERT_TRUE(without.offset_score && with.offset_score);
  EXPECT_GT(without.offset_score->se_kPa, 0.01);
  EXPECT_NEAR(with.offset_score->se_kPa, 0.005, 0.0005);
  EXPECT_NEAR(with.offset_score->value_kPa, 0.05, 0.01);
}

TEST_F(Offset, OneLoadedFrameTellsNothing) {
  Measurement measurement = measured(0.2, 1, 80);
  std::erase_if(measurement.tags, [](const TagPoint& tag) { return tag.frame == 1 || tag.frame == 2; });
  EXPECT_FALSE(test::fit_C1(measurement).offset_score);
}

}  // namespace
}  // namespace diastole
