#include <gmock/gmock.h>

#include <cmath>

#include "estimator/explain/rig/next_experiment.hpp"
#include "host/config/experiment.hpp"
#include "tests/estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

using rig::ModelTerm;
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

/// What a refit of both models finds once the experiment's first segment was really run.
double found_sigma(const rig::SpecimenFamily& family, rig::Session session, const runfile::Segment& planned,
                   const rig::RigFit& truth, const rig::RigFit& other) {
  rig::SessionRun run = rig::empty_run("next", {0.0, "sinusoidal", 1.0, 1.0, 0.0, 1}, 300.0);
  runfile::Segment segment = planned;
  segment.start_s = 1.2;
  run.drive.motion = rig::Motion(rig::strokes_of(segment), 0.0, session.runs[0].drive.motion.spread_s());
  run.drive.place.trigger_s.clear();
  for (int64_t c = 0; c < segment.cycles; ++c)
    run.drive.place.trigger_s.push_back(1.2 + segment.period_s * static_cast<double>(c));
  run.drive.end_s = segment.end_s() + 0.8;
  run.segments = {segment};
  run.sample_s.clear();
  for (double t = 0.0; t <= run.drive.end_s; t += 1.0 / 300.0)
    run.sample_s.push_back(t);
  const rig::RigProblem before(session, family);
  const rig::RigModel model = before.model(truth);
  const rig::PlantTrace plant = rig::simulate_plant(model, run.drive);
  auto& pressure = run.pressure_kPa[rig::Channel::cavity];
  pressure = rig::observe(model, plant, run.drive.place, run.sample_s).cavity_kPa;
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  double correlated = 0.0;
  for (double& value : pressure) {
    correlated = 0.7 * correlated + std::sqrt(0.51) * normal(generator);
    value += noise_kPa * correlated;
  }
  session.runs.push_back(run);
  const rig::RigProblem after(session, family);
  const double gap = after.fit_from(other).chi_square - after.fit_from(truth).chi_square;
  return std::sqrt(std::max(gap, 0.0));
}

TEST(NextExperiment, SeparatesWhatLooksAlikeAsPredicted) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = slow_session(family, "air-bubble-pump", 5.0);
  const rig::RigProblem problem(session, family);
  const rig::RigFit bubble = problem.fit({{find_effect("air-bubble-pump")}});
  const rig::RigFit hose = problem.fit({{find_effect("hose-compliance")}});
  ASSERT_LT(std::abs(bubble.chi_square - hose.chi_square), 9.0) << "the session itself tells them apart";

  const ExperimentDesign design{session, problem, limits_of(session)};
  const auto next = separating_experiment(design, {&bubble, &hose});
  ASSERT_TRUE(next.has_value());
  EXPECT_THAT(next->separates, ElementsAre("air-bubble-pump", "hose-compliance"));
  EXPECT_GT(next->predicted_separation_sigma, 5.0);
  EXPECT_THAT(next->reason, HasSubstr("air-bubble-pump and hose-compliance differ by"));
  EXPECT_NO_THROW(parse_experiment(next->toml, "next.experiment.toml"));

  // The prediction for one segment against what happens when it is run.
  const runfile::Segment segment{0.0, "parabolic", 20.0, 1.2, 0.0, 10};
  const SegmentOutlook outlook = look_ahead(session, problem, {&bubble, &hose}, segment);
  const double predicted = separation(outlook.of(0, 1, {true}), known_before(problem, hose));
  const double found = found_sigma(family, session, segment, bubble, hose);
  EXPECT_GT(found, 3.0);
  EXPECT_THAT(predicted / found, testing::AllOf(testing::Gt(0.65), testing::Lt(1.65)))
      << predicted << " predicted, " << found << " found";
}

TEST(NextExperiment, AnImageAtRestTellsARadiusFromSlippingEnds) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = slow_session(family, "radius-error", -0.06);
  const rig::RigProblem problem(session, family);
  const rig::RigFit radius = problem.fit({{find_effect("radius-error")}});
  const rig::RigFit slip = problem.fit({{find_effect("end-bond-slip")}});
  const Equipment image{true, false, false, true};
  const SpecimenKnowledge knowledge{.inner_radius_mm = 22.5};
  const auto apart = [&](const rig::RigFit& truth, const rig::RigFit& adapting) {
    return separation(gram_beside(truth, adapting, image, knowledge), known_before(problem, adapting));
  };
  const double seen = 22.5 * std::abs(radius.value("radius-error.fraction")) / knowledge.radius_error_mm;
  EXPECT_GT(seen, 5.0);
  EXPECT_NEAR(apart(radius, slip), seen, 1e-6);  // slipping ends leave the radius as it is
  EXPECT_LT(apart(slip, radius), seen);          // a radius that the session only suspects gives way
  EXPECT_EQ(gram_beside(radius, slip, {true}, knowledge).norm(), 0.0);

  const auto next =
      separating_experiment({session, problem, limits_of(session), 2, knowledge}, {&radius, &slip});
  ASSERT_TRUE(next.has_value());
  EXPECT_NO_THROW(parse_experiment(next->toml, "next.experiment.toml"));
}

TEST(NextExperiment, NarrowsWhatIsNamed) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = slow_session(family, "seal-leak-pump", 0.02);
  const rig::RigProblem problem(session, family);
  const rig::RigFit leak = problem.fit({{find_effect("seal-leak-pump")}});
  const auto next = sharpening_experiment({session, problem, limits_of(session)}, leak);
  ASSERT_TRUE(next.has_value());
  EXPECT_THAT(next->reason, HasSubstr("narrows the interval of seal-leak-pump."));
  EXPECT_GT(next->predicted_separation_sigma, 0.0);
  EXPECT_NO_THROW(parse_experiment(next->toml, "next.experiment.toml"));
}

TEST(NextExperiment, ShowsThePlaceOfWhatIsUnexplained) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = slow_session(family, "seal-leak-pump", 0.02);
  const rig::RigProblem problem(session, family);
  Misfit worst;
  worst.port = "drive";
  worst.run = session.runs[0].drive.place.name + ".run.h5";
  worst.segment = 0;
  worst.excess_chi2 = 100.0;
  const auto next = exposing_experiment({session, problem, limits_of(session)}, worst);
  ASSERT_TRUE(next.has_value());
  const Experiment read = parse_experiment(next->toml, "next.experiment.toml");
  ASSERT_EQ(read.segments.size(), 2U);
  EXPECT_EQ(read.segments[1].period_s, 2 * read.segments[0].period_s);
  EXPECT_GT(next->predicted_separation_sigma, 10.0);
  worst.run = "";
  EXPECT_FALSE(exposing_experiment({session, problem, limits_of(session)}, worst).has_value());
}

}  // namespace
}  // namespace diastole::explain
