#include <gmock/gmock.h>

#include <cmath>

#include "estimator/explain/rig/next_experiment.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/inference/information.hpp"
#include "estimator/rig_fit/simulated_session.hpp"
#include "host/config/experiment.hpp"

namespace diastole::explain {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double noise_kPa = 0.12;

/// One slow run, the cavity's pressure only: much looks alike in it.
rig::Session slow_session(const rig::SpecimenFamily& family, const char* id, double value) {
  rig::Session session = rig::simulated_session(
      family, {.terms = {{find_effect(id)}}, .values = {value}, .noise_kPa = noise_kPa});
  session.runs.erase(session.runs.begin(), session.runs.begin() + 1);
  session.runs.resize(1);
  session.runs[0].pressure_kPa.erase(rig::Channel::pump);
  return session;
}

TEST(ExperimentPlan, StaysWithinTheLimits) {
  ExperimentLimits limits{.inertance = rig::Hose{}.inertance()};
  const auto all = possible_segments(limits);
  EXPECT_GE(all.size(), 12U);
  limits.largest_mL = 20.0;
  for (const auto& segment : possible_segments(limits))
    EXPECT_LE(segment.offset_mL + segment.stroke_mL, 20.0) << words_of(segment);
  limits.acceleration_mL_s2 = 100.0;
  const auto gentle = possible_segments(limits);
  EXPECT_LT(gentle.size(), all.size());
  for (const auto& segment : gentle) {
    if (segment.waveform != "parabolic") continue;
    EXPECT_LT(16 * segment.stroke_mL / std::pow(segment.period_s, 2), 90.0);
  }
}

TEST(ExperimentPlan, WritesFilesThatDiastoleRunReads) {
  PlannedExperiment plan{possible_segments({.inertance = rig::Hose{}.inertance()}), true, true, true, true};
  const Experiment read = parse_experiment(to_toml(plan, "Separates a from b"), "next.experiment.toml");
  ASSERT_EQ(read.segments.size(), plan.segments.size());
  EXPECT_EQ(read.gate_every, 2);
  for (size_t i = 0; i < plan.segments.size(); ++i) {
    EXPECT_EQ(read.segments[i].waveform_name, plan.segments[i].waveform);
    EXPECT_EQ(read.segments[i].stroke_mL, plan.segments[i].stroke_mL);
    EXPECT_EQ(read.segments[i].offset_mL, plan.segments[i].offset_mL);
    EXPECT_GE(read.segments[i].cycles, plan.segments[i].cycles);
  }
}

TEST(ExperimentPlan, ATrialRunsTheSegmentsFirstCycles) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = slow_session(family, "air-bubble-pump", 5.0);
  const TrialRun trial = trial_of({0.0, "parabolic", 10.0, 1.0, 20.0, 15}, session);
  EXPECT_EQ(trial.drive.place.trigger_s.size(), 3U);
  EXPECT_EQ(trial.repeats, 13.0);
  EXPECT_EQ(trial.last_end - trial.last_first, 300U);
  EXPECT_NEAR(trial.drive.motion.at(trial.drive.place.trigger_s[1] + 0.5).volume_mL, 30.0, 0.1);
  EXPECT_NEAR(trial.drive.motion.at(trial.drive.end_s).volume_mL, 0.0, 1e-9);
  EXPECT_GT(trial.drive.place.started_s, 60.0);
}

/// A session and sets of effects fitted to it.
struct Fitted {
  rig::SpecimenFamily family = rig::gel_family();
  rig::Session session;
  rig::SessionProblem problem;
  rig::LinearisedModel declared;

  Fitted(const char* id, double value)
      : session(slow_session(family, id, value)),
        problem(session, family, 2),
        declared(declared_rig(problem)) {}
  EffectSet fit(const char* id) const {
    const Effect& effect = *find_effect(id);
    rig::SessionModel start = declared.at;
    start.terms = {{&effect, {}}};
    for (const EffectParameter& parameter : effect.parameters())
      start.values.push_back(parameter.typical);
    return fit_set(problem, start, declared, problem.error().prior.share);
  }
};

TEST(NextExperiment, SeparatesWhatLooksAlike) {
  const Fitted fitted("air-bubble-pump", 5.0);
  const FittedModel bubble = fitted_model(fitted.problem, fitted.fit("air-bubble-pump"));
  const FittedModel hose = fitted_model(fitted.problem, fitted.fit("hose-compliance"));
  const auto next = separating_experiment({fitted.problem, limits_of(fitted.session)}, {&bubble, &hose});
  ASSERT_TRUE(next.has_value());
  EXPECT_THAT(next->separates, ElementsAre("air-bubble-pump", "hose-compliance"));
  EXPECT_GT(next->predicted_separation_sigma, 5.0);
  EXPECT_THAT(next->reason, HasSubstr("air-bubble-pump and hose-compliance differ by"));
  EXPECT_NO_THROW(parse_experiment(next->toml, "next.experiment.toml"));
}

TEST(NextExperiment, AnImageAtRestTellsARadiusFromSlippingEnds) {
  const Fitted fitted("radius-error", -0.06);
  const FittedModel radius = fitted_model(fitted.problem, fitted.fit("radius-error"));
  const FittedModel slip = fitted_model(fitted.problem, fitted.fit("end-bond-slip"));
  const Equipment image{true, false, false, true};
  const SpecimenKnowledge knowledge{.inner_radius_mm = 22.5};
  const auto apart = [&](const FittedModel& truth, const FittedModel& adapting) {
    return inference::separation(gram_beside(fitted.problem, truth, adapting, image, knowledge),
                                 known_before(adapting));
  };
  const double seen = 22.5 * std::abs(radius.model.values[0]) / knowledge.radius_error_mm;
  EXPECT_GT(seen, 1.0);
  EXPECT_NEAR(apart(radius, slip), seen, 1e-6);  // slipping ends leave the radius as it is
  EXPECT_LT(apart(slip, radius), seen);          // a radius that the session only suspects gives way
  EXPECT_EQ(gram_beside(fitted.problem, radius, slip, {true}, knowledge).norm(), 0.0);
}

TEST(NextExperiment, NarrowsWhatIsNamed) {
  const Fitted fitted("seal-leak-pump", 0.02);
  const FittedModel leak = fitted_model(fitted.problem, fitted.fit("seal-leak-pump"));
  const auto next = sharpening_experiment({fitted.problem, limits_of(fitted.session)}, leak);
  ASSERT_TRUE(next.has_value());
  EXPECT_THAT(next->reason, HasSubstr("narrows the interval of seal-leak-pump."));
  EXPECT_GT(next->predicted_separation_sigma, 0.0);
  EXPECT_NO_THROW(parse_experiment(next->toml, "next.experiment.toml"));
}

TEST(NextExperiment, ShowsThePlaceOfWhatIsUnexplained) {
  const Fitted fitted("seal-leak-pump", 0.02);
  Misfit worst;
  worst.port = "drive";
  worst.run = fitted.session.runs[0].drive.place.name + ".run.h5";
  worst.segment = 0;
  worst.excess_chi2 = 100.0;
  const ExperimentDesign design{fitted.problem, limits_of(fitted.session)};
  const auto next = exposing_experiment(design, worst);
  ASSERT_TRUE(next.has_value());
  const Experiment read = parse_experiment(next->toml, "next.experiment.toml");
  ASSERT_EQ(read.segments.size(), 2U);
  EXPECT_EQ(read.segments[1].period_s, 2 * read.segments[0].period_s);
  EXPECT_GT(next->predicted_separation_sigma, 10.0);
  worst.run = "";
  EXPECT_FALSE(exposing_experiment(design, worst).has_value());
}

}  // namespace
}  // namespace diastole::explain
