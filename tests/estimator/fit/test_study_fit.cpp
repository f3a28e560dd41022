#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>

#include "estimator/fit/study_fit.hpp"
#include "tests/estimator/fit/synthetic.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::message_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;

std::filesystem::path example(const char* name) {
  return std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples" / name;
}

// phantom-a is made by an independent program with C1 = 8.71; the pressures' errors alone push the best
// estimate to 8.57.
void expect_phantom_a(const char* name, const char* data) {
  constexpr double phantom_kPa = 8.71;
  const Study study = read_study(example(name));
  const FitRecord fit = fit_study(study, read_measurement(study), {});
  EXPECT_TRUE(fit.converged) << fit.reason;
  EXPECT_EQ(fit.data, data);
  ASSERT_EQ(fit.parameters.size(), 1U);
  const FittedParameter& C1 = fit.parameters[0];
  EXPECT_EQ(C1.name, "C1_kPa");
  EXPECT_NEAR(C1.value / phantom_kPa, 1.0, 0.02);
  EXPECT_LE(C1.ci95[0], phantom_kPa);
  EXPECT_GE(C1.ci95[1], phantom_kPa);
  EXPECT_NEAR(C1.se, 0.08, 0.02);
  EXPECT_NEAR(fit.rms_mm, 0.8, 0.02);
  EXPECT_NEAR(fit.chi2_per_dof, 1.0, 0.05);
  EXPECT_EQ(fit.outliers_5sigma, 0U);
  EXPECT_THAT(fit.excluded, testing::IsEmpty());
  EXPECT_THAT(fit.remarks, Contains(HasSubstr("as the stated noise says")));
  EXPECT_THAT(fit.remarks,
              Contains(HasSubstr("variance of C1_kPa comes from the error of the measured pressures")));
  ASSERT_EQ(fit.frames.size(), 5U);
  for (const FittedFrame& frame : fit.frames) {
    EXPECT_NEAR(frame.estimated_kPa, frame.measured_kPa, 3 * frame.sigma_kPa);
    EXPECT_LE(frame.se_kPa, frame.sigma_kPa);
  }
  ASSERT_EQ(fit.sections.size(), 2U);
  for (const FitSection& section : fit.sections) {
    EXPECT_GT(section.observed.h_mm.size(), 20U) << section.title;
    EXPECT_EQ(section.lines_before.size(), section.lines_after.size());
    EXPECT_GT(section.lines_after.size(), 10U) << section.title;
  }
}

TEST(PhantomA, TagsGiveTheStiffness) { expect_phantom_a("phantom-a.study.toml", "tags"); }
TEST(PhantomA, PointsGiveTheStiffness) { expect_phantom_a("phantom-a-points.study.toml", "points"); }

class CoarseStudy : public testing::Test {
 protected:
  CoarseStudy() {
    study_.file = "gel.study.toml";
    study_.specimen = AnnulusSpecimen{22.5, 50, 85, {4, 2, 1}, "fixed"};
    study_.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 15.0, Variation::whole}}};
    ElasticModel truth = test::coarse_gel(8.71);
    measurement_ = test::synthetic(truth, {});
  }
  FitRecord fit() const { return fit_study(study_, measurement_, {}); }

  Study study_;
  Measurement measurement_;
};

TEST_F(CoarseStudy, NoiseThatIsStatedTooSmallOrTooLargeIsSaid) {
  for (TagPoint& tag : measurement_.tags)
    tag.sigma_mm *= 0.5;
  const FitRecord small = fit();
  EXPECT_NEAR(small.chi2_per_dof, 4.0, 0.8);
  EXPECT_THAT(small.remarks,
              Contains(AllOf(HasSubstr("larger than the stated noise"), HasSubstr("interval"))));
  EXPECT_THAT(small.remarks, Contains(HasSubstr("Frame 0 contradicts")));
  for (TagPoint& tag : measurement_.tags)
    tag.sigma_mm *= 4;
  EXPECT_THAT(fit().remarks, Contains(HasSubstr("smaller than the stated noise")));
}

TEST_F(CoarseStudy, APressureThatTheMotionContradictsIsSaidAndAnOffsetIsNone) {
  const auto said = Contains(HasSubstr("contradicts the pressure"));
  constexpr double wrong_kPa = 0.3;
  ElasticModel truth = test::coarse_gel(8.71);
  measurement_ = test::synthetic(truth, {.pressures_kPa = {1.0, 2.0, 3.0}, .sigma_mm = 0.1});
  EXPECT_THAT(fit().remarks, Not(said));
  const Measurement sound = measurement_;
  measurement_.frames[2].pressure_kPa += wrong_kPa;
  EXPECT_THAT(fit().remarks,
              Contains(AllOf(HasSubstr("contradicts the pressure"), HasSubstr("frame 2 was read at"))));
  measurement_ = sound;
  for (size_t frame = 1; frame < measurement_.frames.size(); ++frame)
    measurement_.frames[frame].pressure_kPa += wrong_kPa;
  StudyFitOptions options;
  options.pressure_offset_sigma_kPa = wrong_kPa;
  const FitRecord with_offset = fit_study(study_, measurement_, options);
  ASSERT_TRUE(with_offset.pressure_offset_kPa);
  EXPECT_THAT(with_offset.remarks, Not(said));
}

TEST_F(CoarseStudy, ErrorsOfTheWallsAreNotBlamedOnThePressures) {
  for (Frame& frame : measurement_.frames)
    frame.sigma_kPa = 0;
  StudyFitOptions options;
  options.geometry_sigma_mm = 0.5;
  const FitRecord record = fit_study(study_, measurement_, options);
  ASSERT_TRUE(record.parameters[0].variance_shares);
  EXPECT_GT(record.parameters[0].variance_shares->geometry, 0.2);
  EXPECT_THAT(record.remarks,
              Contains(AllOf(StartsWith("0 % of the variance of C1_kPa"),
                             HasSubstr(fmt::format("would be {:.3g}", record.parameters[0].se)))));
}

TEST_F(CoarseStudy, OutliersAreCountedAndSaid) {
  TagPoint& tag = measurement_.tags.back();
  tag.normal = {1, 0, 0};
  tag.plane_mm = 30;
  tag.x_mm = {33.9, 0, 0};  // 1.7 mm, or 5.7 sigma, beyond where this plane has moved
  const FitRecord record = fit();
  EXPECT_EQ(record.outliers_5sigma, 1U);
  EXPECT_THAT(record.remarks, Contains(HasSubstr("1 residuals are beyond 5")));
}

TEST_F(CoarseStudy, FrameZeroIsACheckAndNotFitted) {
  const FitRecord with = fit();
  EXPECT_EQ(with.undeformed.points, 150U);
  EXPECT_NEAR(with.undeformed.chi2_per_residual, 1.0, 0.4);
  std::erase_if(measurement_.tags, [](const TagPoint& tag) { return tag.frame == 0; });
  const FitRecord without = fit();
  EXPECT_EQ(without.undeformed.points, 0U);
  EXPECT_DOUBLE_EQ(with.parameters[0].value, without.parameters[0].value);
}

TEST_F(CoarseStudy, RegionalValuesComeWithTheirMean) {
  study_.law.parameters[0].vary = Variation::element;
  const FitRecord record = fit();
  const FittedParameter& C1 = record.parameters[0];
  ASSERT_EQ(C1.elements.size(), 8U);
  double sum = 0, least_se = 1e9;
  for (const FittedElement& element : C1.elements) {
    sum += element.value;
    least_se = std::min(least_se, element.se);
  }
  EXPECT_NEAR(C1.value, sum / 8, 1e-9);
  EXPECT_LT(C1.se, least_se);
  EXPECT_NEAR(C1.value, 8.71, 4 * C1.se);
  EXPECT_EQ(record.correlation.names.size(), 8U + 2U);
  EXPECT_THAT(record.remarks, Contains(HasSubstr("as the data themselves say")));
}

TEST_F(CoarseStudy, ABoundIsSaid) {
  study_.law.parameters[0] = {"C1_kPa", 6.0, 1.0, 7.0, Variation::whole};
  const FitRecord record = fit();
  EXPECT_EQ(record.parameters[0].at_bound, "upper");
  EXPECT_THAT(record.remarks, Contains(AllOf(HasSubstr("upper bound"), HasSubstr("[1, 7]"))));
}

// Five of the eight values end on the bound of 9: with them held, the others' search must
// not slow down.
TEST_F(CoarseStudy, AnElementOnItsBoundIsHeldAndTheMeanSaysSo) {
  study_.law.parameters[0] = {"C1_kPa", 6.0, 1.0, 9.0, Variation::element, {Smoothness::Kind::none}};
  const FitRecord record = fit();
  EXPECT_TRUE(record.converged) << record.reason;
  EXPECT_LE(record.iterations, 7);
  for (const FitIteration& step : record.history)
    EXPECT_TRUE(step.accepted) << "iteration " << step.iteration;
  const FittedParameter& C1 = record.parameters[0];
  EXPECT_EQ(C1.at_bound, "upper");
  size_t held = 0;
  for (const FittedElement& element : C1.elements) {
    EXPECT_EQ(std::isnan(element.se), element.value > 9.0 - 1e-6) << element.value;
    EXPECT_EQ(std::isnan(element.ci95[0]), std::isnan(element.se));
    held += std::isnan(element.se) ? 1 : 0;
  }
  EXPECT_GT(held, 0U);
  EXPECT_LT(held, C1.elements.size());
  EXPECT_THAT(record.remarks, Contains(AllOf(HasSubstr("conditional on the bound"),
                                             HasSubstr(fmt::format("{} of 8 elements", held)))));
}

TEST_F(CoarseStudy, AStartOnABoundIsLeftWhenTheCostFallsInside) {
  study_.law.parameters[0] = {"C1_kPa", 6.0, 1.0, 15.0, Variation::element, {Smoothness::Kind::none}};
  const FitRecord inside = fit();
  study_.law.parameters[0].start = 15.0;
  const FitRecord from_bound = fit();
  EXPECT_TRUE(from_bound.converged) << from_bound.reason;
  EXPECT_NEAR(from_bound.chi2, inside.chi2, 1e-6 * inside.chi2);
  EXPECT_EQ(from_bound.parameters[0].at_bound, "");
}

TEST_F(CoarseStudy, PointsThatAreNotOnTheSpecimenAreRefused) {
  const Measurement sound = measurement_;
  for (const double per_mm : {0.1, 0.001, 1 / 25.4}) {
    measurement_ = sound;
    for (TagPoint& tag : measurement_.tags) {
      tag.plane_mm *= per_mm;
      for (double& x_mm : tag.x_mm)
        x_mm *= per_mm;
    }
    EXPECT_THAT(message_of([&] { (void)fit(); }), AllOf(HasSubstr("gel.study.toml"), HasSubstr("only 0 of"),
                                                        HasSubstr("coordinates are in mm")))
        << per_mm;
  }
  measurement_ = sound;
  for (size_t i = 0; i < measurement_.tags.size(); ++i) {
    if (i % 5 < 3) measurement_.tags[i].x_mm = {90, 0, 0};
  }
  EXPECT_THAT(message_of([&] { (void)fit(); }), HasSubstr("lie on the specimen"));
}

TEST_F(CoarseStudy, WhatCannotBeFittedIsRefused) {
  Study other = study_;
  other.law.name = "neo-hokean";
  EXPECT_THAT(message_of([&] { (void)fit_study(other, measurement_, {}); }),
              AllOf(HasSubstr("gel.study.toml"), HasSubstr("neo-hokean"), HasSubstr("neo-hookean")));
  other = study_;
  other.effects = {"end-bond-slop"};
  EXPECT_THAT(message_of([&] { (void)fit_study(other, measurement_, {}); }), HasSubstr("end-bond-slop"));
  other = study_;
  other.law.parameters[0] = {"C1_kPa", 6.0, -1.0, 15.0, Variation::whole};
  EXPECT_THAT(message_of([&] { (void)fit_study(other, measurement_, {}); }), HasSubstr("lower bound -1"));
  const test::ScratchFolder folder;
  other.law = {"own.law.toml", {{"c", 6.0, 1.0, 15.0, Variation::whole}}, folder.write("own.law.toml", R"toml(
format = "diastole-law"
version = 1
id = "own"
energy_kPa = "c * (I1 - 3)"
[[parameter]]
name = "c"
unit = "kPa"
bounds = [0, 10]
typical = 8
)toml")};
  EXPECT_THAT(message_of([&] { (void)fit_study(other, measurement_, {}); }), HasSubstr("upper bound 15"));
  std::erase_if(measurement_.tags, [](const TagPoint& tag) { return tag.frame > 0; });
  EXPECT_THAT(message_of([&] { (void)fit(); }), HasSubstr("frame 0"));
}

}  // namespace
}  // namespace diastole
