#include "estimator/explain/rig/set_verdict.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/explain/rig/equation_errors.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

TEST(SetVerdict, NothingIsWrongOnlyByAModelThatTheDataDoNotExclude) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = rig::simulated_session(family, {.terms = {}, .values = {}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  const WeighedSets search = search_sets(problem);
  const auto plain = std::ranges::find_if(search.sets, [&](const EffectSet& set) {
    return set.ids().empty() && problem.prior(set.model).described.minCoeff() == 1.0;
  });
  ASSERT_NE(plain, search.sets.end());
  // With an effect that is far too small for a name, and a part of the rig that is too far off to be a tolerance.
  EffectSet strained = *plain;
  strained.model.terms.push_back({find_effect("sensor-gain"), {}});
  strained.model.values.push_back(1e-6);
  strained.model.nuisances.tail(1)[0] = 5.0;
  WeighedSets made = search;
  made.sets = {strained, *plain};
  const auto verdict = [&](double without) {
    made.probability = {1.0 - without, without};
    return judge_sets(problem, made, {});
  };
  EXPECT_EQ(verdict(0.2).verdict, Verdict::none);
  EXPECT_EQ(verdict(1e-9).verdict, Verdict::unexplained);
  // One of so many tolerances five sds to either side.
  const double by_chance = static_cast<double>(problem.nuisances().size() - rig::basic_nuisances) *
                           std::erfc(5.0 / std::numbers::sqrt2);
  EXPECT_NEAR(verdict(1e-9).confidence, 1.0 / (1.0 - std::numbers::e * by_chance * std::log(by_chance)),
              2e-4);
}

TEST(SetVerdict, WhatTheModulusTakesOfAChangeMakesItNoTolerance) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = rig::simulated_session(family, {.terms = {}, .values = {}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  const WeighedSets search = search_sets(problem);
  const EffectSet& plain = search.sets.front();
  const Eigen::VectorXd modulus = plain.known.columns.col(0);
  const Eigen::VectorXd tolerance = plain.known.columns.col(rig::basic_nuisances + 1);
  // What no smooth part of a rig does: every second feature up by three sds, the others down.
  Eigen::VectorXd own = 3.0 * plain.evidence.variance.cwiseSqrt();
  for (Eigen::Index k = 1; k < own.size(); k += 2)
    own[k] = -own[k];
  EXPECT_TRUE(size_of_change(problem, plain, tolerance).is_tolerance);
  EXPECT_TRUE(size_of_change(problem, plain, 100.0 * modulus + tolerance).is_tolerance);
  EXPECT_FALSE(size_of_change(problem, plain, own).is_tolerance);
  EXPECT_FALSE(size_of_change(problem, plain, 1000.0 * modulus + own).is_tolerance);
}

TEST(EquationErrors, TakeTheGainOfWhatActsWhereALargerEffectDoes) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = rig::simulated_session(family, {.terms = {}, .values = {}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  EffectSet set = search_sets(problem).sets.back();
  set.model.terms = {{find_effect("cannula-leak-cavity"), {}}, {find_effect("sensor-drift"), {}}};
  set.by_part = false;  // its evidence is set below
  const Eigen::MatrixXd nuisances = set.columns.rightCols(set.model.nuisances.size());
  const Eigen::VectorXd of_nuisances = set.evidence.estimate.tail(nuisances.cols());
  set.columns = Eigen::MatrixXd::Zero(nuisances.rows(), nuisances.cols() + 2);
  set.columns.rightCols(nuisances.cols()) = nuisances;
  set.evidence.estimate = Eigen::VectorXd::Zero(set.columns.cols());
  set.evidence.estimate.tail(of_nuisances.size()) = of_nuisances;
  // What no smooth part of a rig does, up and down: the larger one in every other pair of features, by sixty sds.
  Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(nuisances.rows(), 2);
  const auto set_pairs = [&](Eigen::Index effect, Eigen::Index first, double sds) {
    for (Eigen::Index k = first; k + 1 < changes.rows(); k += 4)
      for (Eigen::Index i = 0; i < 2; ++i)
        changes(k + i, effect) = (i == 0 ? sds : -sds) * std::sqrt(set.evidence.variance[k + i]);
  };
  set_pairs(0, 0, 60.0);
  const auto odds_beside = [&](const Eigen::MatrixXd& of) {
    EffectSet without = set;
    without.evidence.left += of.col(1);
    return log_odds_beside_equation_errors(problem, set, without, of, 1);
  };
  const auto odds_alone = [&] {
    Eigen::MatrixXd alone = changes;
    alone.col(0).setZero();
    return odds_beside(alone);
  };
  const double sure = std::log(9.0);

  // A fifth of what the equations may err by, in all of some twenty octaves and kinds.
  changes.col(1) = 0.02 * changes.col(0);
  EXPECT_GT(odds_alone(), sure);
  EXPECT_LT(odds_beside(changes), sure);
  changes.col(1).setZero();
  set_pairs(1, 2, 3.0);
  EXPECT_GT(odds_alone(), sure);
  EXPECT_GT(odds_beside(changes), sure);
}

TEST(SetVerdict, WhatTheDataSpeakForAndNewWaveformsDoNotBearMayBeNothing) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = rig::simulated_session(family, {.terms = {}, .values = {}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  WeighedSets made = search_sets(problem);
  const auto plain = std::ranges::find_if(made.sets, [&](const EffectSet& set) {
    return set.ids().empty() && problem.prior(set.model).described.minCoeff() == 1.0;
  });
  ASSERT_NE(plain, made.sets.end());
  // A drift that would be material, of a sensor that does not drift.
  EffectSet drifting = *plain;
  drifting.model.terms.push_back({find_effect("sensor-drift"), {}});
  drifting.model.values.push_back(100.0);
  made.sets = {drifting, *plain};
  made.probability = {0.97, 0.03};
  const SetVerdict doubtful = judge_sets(problem, made, {});
  ASSERT_TRUE(doubtful.log_pseudo_bayes_factor);
  EXPECT_NEAR(*doubtful.log_pseudo_bayes_factor, 0.0, 1e-9);  // it changes nothing here
  EXPECT_EQ(doubtful.verdict, Verdict::ambiguous);
  EXPECT_EQ(doubtful.ambiguous_with, std::vector<std::vector<std::string>>{{}});
  // Where a part would have to be far off without it, something is wrong for all that.
  made.sets[1].model.nuisances.tail(1)[0] = 5.0;
  const SetVerdict refuted = judge_sets(problem, made, {});
  EXPECT_EQ(refuted.verdict, Verdict::unexplained);
  EXPECT_NEAR(refuted.confidence, 40.0 / 41.0, 1e-9)
      << "an effect's odds beforehand, and other waveforms say nothing";
}

/// As the recordings of a rig in which nothing else is wrong.
SetVerdict verdict_beside_a_tone(double amplitude_kPa) {
  const rig::SpecimenFamily family = rig::gel_family();
  rig::Session session = rig::simulated_session(family, {.terms = {}, .values = {}, .seed = 5},
                                                {0.0, "parabolic", 40.0, 1.2, 0.0, 12});
  for (rig::SessionRun& run : session.runs)
    for (size_t k = 0; k < run.sample_s.size(); ++k)
      run.pressure_kPa[rig::Channel::cavity][k] +=
          amplitude_kPa * std::sin(2 * std::numbers::pi * 31.41 * run.sample_s[k]);
  const rig::SessionProblem problem(session, family, 2);
  return judge_sets(problem, search_sets(problem), {});
}

TEST(SetVerdict, ThatNothingIsWrongIsNotSaidBesideALoudTone) {
  const SetVerdict loud = verdict_beside_a_tone(0.06);
  EXPECT_EQ(loud.verdict, Verdict::unexplained);
  EXPECT_TRUE(loud.is_tone_alone);
  ASSERT_TRUE(loud.tone);
  EXPECT_NEAR(loud.tone->frequency_Hz, 31.41, 2 * loud.tone->resolution_Hz);
  const SetVerdict quiet = verdict_beside_a_tone(0.005);
  EXPECT_EQ(quiet.verdict, Verdict::none);
  EXPECT_FALSE(quiet.tone);
}

}  // namespace
}  // namespace diastole::explain
