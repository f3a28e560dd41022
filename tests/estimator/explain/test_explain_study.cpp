// Runs and images of one study, explained together.

#include "estimator/explain/explain_study.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::explain {
namespace {

Study gel() {
  Study study;
  study.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 15.0, Variation::whole}}};
  return study;
}

Explanation of(Verdict verdict, std::vector<std::string> ids = {},
               std::vector<std::vector<std::string>> others = {}) {
  Explanation explanation;
  explanation.verdict = verdict;
  for (const std::string& id : ids)
    explanation.effects.push_back({id, {}, {}});
  explanation.ambiguous_with = std::move(others);
  explanation.law = {{"C1_kPa", 8.0, 0.1, 8.5, 0.08}};
  return explanation;
}

TEST(RunsAndImages, TheImagesModulusIsAMeasurementForTheRuns) {
  const StudyParameter modulus = with_imaged_modulus(gel(), of(Verdict::named)).law.parameters.front();
  EXPECT_DOUBLE_EQ(modulus.start, 8.5);
  EXPECT_NEAR(std::log(modulus.upper / modulus.lower) / std::sqrt(12.0), std::hypot(0.08 / 8.5, 0.007),
              1e-12);
}

TEST(RunsAndImages, AModulusOfALawFileIsOneByItsUnit) {
  const test::ScratchFolder folder;
  const auto upper = [&](const std::string& unit, const std::string& energy) {
    Study study;
    study.law = {"own.law.toml",
                 {{"c", 6.0, 1.0, 15.0, Variation::whole}},
                 folder.write(unit.empty() ? "number.law.toml" : "modulus.law.toml",
                              "format = \"diastole-law\"\nversion = 1\nid = \"own\"\nenergy_kPa = \"" +
                                  energy + "\"\n[[parameter]]\nname = \"c\"\nunit = \"" + unit +
                                  "\"\nbounds = [0, 100]\ntypical = 8\n")};
    Explanation field = of(Verdict::named);
    field.law.front().name = "c";
    return with_imaged_modulus(study, field).law.parameters.front().upper;
  };
  EXPECT_LT(upper("kPa", "c * (I1 - 3)"), 9.0);
  EXPECT_EQ(upper("", "8 [kPa] * (I1 - 3) * exp(c * (I1 - 3))"), 15.0);
}

TEST(RunsAndImages, WhatImagesDoNotExplainSaysNothingOfTheModulus) {
  for (const Verdict verdict : {Verdict::unexplained, Verdict::ambiguous})
    EXPECT_EQ(with_imaged_modulus(gel(), of(verdict)).law.parameters.front().upper, 15.0);
  Explanation on_bound = of(Verdict::named);
  on_bound.law.front().after_error = 0.0;
  EXPECT_EQ(with_imaged_modulus(gel(), on_bound).law.parameters.front().upper, 15.0);
  Study known = gel();
  known.law.parameters.front() = {"C1_kPa", 8.0, 7.99, 8.01, Variation::whole};
  EXPECT_EQ(with_imaged_modulus(known, of(Verdict::named)).law.parameters.front().upper, 8.01);
}

TEST(RunsAndImages, AnEffectThatShowsInBothIsJudgedByBoth) {
  const Explanation both =
      merged(of(Verdict::ambiguous, {"radius-error"}, {{"stroke-gain"}, {"end-bond-slip"}}),
             of(Verdict::named, {"radius-error"}));
  EXPECT_EQ(both.verdict, Verdict::named);
  EXPECT_TRUE(both.ambiguous_with.empty());
  EXPECT_EQ(both.effects.size(), 1U);
}

/// Runs say the fraction by which a radius is larger, images the radius; the stiffening of both is one number.
TEST(RunsAndImages, AQuantityOfBothHasOneValue) {
  Explanation runs = of(Verdict::named, {"strain-stiffening", "radius-error"});
  runs.effects[0].parameters = {{"beta", 1.0, 0.5, {0.2, 1.8}}};
  runs.effects[1].parameters = {{"fraction", 0.04, 0.01, {0.02, 0.06}}};
  Explanation images = of(Verdict::named, {"radius-error", "strain-stiffening"});
  images.effects[0].parameters = {{"true_inner_radius_mm", 23.4, 0.1, {23.2, 23.6}}};
  images.effects[1].parameters = {{"beta", 1.2, 0.1, {1.0, 1.4}}};
  const Explanation both = merged(std::move(runs), std::move(images));
  ASSERT_EQ(both.effects.size(), 2U);
  ASSERT_EQ(both.effects[0].parameters.size(), 1U);
  EXPECT_EQ(both.effects[0].parameters[0].value, 1.2);
  EXPECT_EQ(both.effects[1].parameters.size(), 2U);
}

TEST(RunsAndImages, WhatWasSaidOfSetsThatTheOtherDataExcludeGoesWithThem) {
  Explanation runs = of(Verdict::ambiguous, {"radius-error"}, {{}});
  runs.confidence = 0.8;
  runs.next_experiment = NextExperiment{};
  runs.summary = "Too weak to name.";
  const Explanation both = merged(std::move(runs), of(Verdict::named, {"radius-error"}));
  EXPECT_EQ(both.verdict, Verdict::named);
  EXPECT_FALSE(both.confidence);
  EXPECT_FALSE(both.next_experiment);
  EXPECT_EQ(both.summary.find("Too weak"), std::string::npos);
  EXPECT_NE(both.summary.find("lacks radius-error"), std::string::npos) << both.summary;
}

TEST(RunsAndImages, ASetThatTheOtherDataExcludeNeedsNoSearchThatSettled) {
  using inference::Termination;
  Explanation runs = of(Verdict::ambiguous, {"radius-error"}, {{"stroke-gain"}});
  runs.searches = {{{}, Termination::converged},
                   {{"radius-error"}, Termination::converged},
                   {{"stroke-gain"}, Termination::iteration_limit}};
  runs.converged = false;
  const Explanation both = merged(std::move(runs), of(Verdict::named, {"radius-error"}));
  EXPECT_EQ(both.verdict, Verdict::named);
  EXPECT_TRUE(both.converged);
  EXPECT_EQ(both.searches.size(), 2U);
}

TEST(RunsAndImages, NothingIsNamedByASearchThatDidNotSettleWhateverTheOtherDataExclude) {
  using inference::Termination;
  Explanation runs = of(Verdict::ambiguous, {"radius-error"}, {{}});
  runs.searches = {{{}, Termination::converged}, {{"radius-error"}, Termination::stalled}};
  const Explanation both = merged(std::move(runs), of(Verdict::named, {"radius-error"}));
  EXPECT_EQ(both.verdict, Verdict::unexplained);
  EXPECT_FALSE(both.converged);
  EXPECT_NE(both.summary.find("The search of radius-error did not converge"), std::string::npos)
      << both.summary;
}

TEST(RunsAndImages, WhatTheyDisagreeOnStaysOpen) {
  const std::vector<std::vector<std::string>> others{{"stroke-gain"}};
  EXPECT_EQ(
      merged(of(Verdict::ambiguous, {"radius-error"}, others), of(Verdict::named, {"tag-bias"})).verdict,
      Verdict::ambiguous);
  EXPECT_EQ(merged(of(Verdict::ambiguous, {"radius-error"}, others), of(Verdict::none)).verdict,
            Verdict::ambiguous);
  EXPECT_EQ(merged(of(Verdict::named, {"seal-leak-pump"}), of(Verdict::unexplained)).verdict,
            Verdict::unexplained);
}

TEST(RunsAndImages, TheConfidenceOfTheRunsIsThatOfTheirOwnVerdictAlone) {
  Explanation nothing = of(Verdict::none);
  nothing.confidence = 0.97;
  EXPECT_EQ(merged(nothing, of(Verdict::none)).confidence, 0.97);
  EXPECT_FALSE(merged(nothing, of(Verdict::unexplained)).confidence);
}

}  // namespace
}  // namespace diastole::explain
