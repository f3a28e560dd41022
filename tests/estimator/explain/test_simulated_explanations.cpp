// Sessions that the model under test has made itself, with and without an effect: what the search and the verdict make of
// them. Data of independent programs judge the method (test_recorded_explanations.cpp, tools/bench explain --worlds).

#include <gmock/gmock.h>

#include <cmath>
#include <optional>
#include <utility>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/rig/findings.hpp"
#include "estimator/explain/rig/held_out.hpp"
#include "estimator/explain/rig/value_errors.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class SimulatedSession : public testing::Test {
 protected:
  void search(const rig::SessionOptions& options, size_t runs = 3) {
    search(rig::simulated_session(family_, options), runs);
  }
  void search(rig::Session session, size_t runs) {
    session_ = std::move(session);
    session_.runs.resize(runs);
    problem_.emplace(session_, family_, 2);
    found_ = search_sets(*problem_);
    verdict_ = judge_sets(*problem_, found_, {});
  }
  const EffectSet& chosen() const { return found_.sets[verdict_.chosen]; }
  const EffectSet& plain() const {
    return *std::ranges::find_if(found_.sets, [](const EffectSet& set) { return set.model.terms.empty(); });
  }
  rig::SpecimenFamily family_ = rig::gel_family();
  rig::Session session_;
  std::optional<rig::SessionProblem> problem_;
  WeighedSets found_;
  SetVerdict verdict_;
};

TEST_F(SimulatedSession, WithoutAnEffectGetsNoName) {
  search({.seed = 4});
  EXPECT_EQ(verdict_.verdict, Verdict::none);
  EXPECT_THAT(misfits(*problem_, plain(), plain()), IsEmpty());
}

TEST_F(SimulatedSession, WithALeakIsExplainedByItAndPredictsWhatWasNotFitted) {
  search({.terms = {{find_effect("cannula-leak-cavity"), {}}}, .values = {0.15}, .seed = 5});
  ASSERT_EQ(verdict_.verdict, Verdict::named);
  const auto effects = found_effects(*problem_, chosen(), verdict_);
  ASSERT_EQ(effects.size(), 1U);
  EXPECT_EQ(effects[0].id, "cannula-leak-cavity");
  EXPECT_LT(effects[0].parameters.at(0).ci90[0], 0.15);
  EXPECT_GT(effects[0].parameters.at(0).ci90[1], 0.15);
  EXPECT_GT(effects[0].parameters.at(0).standard_error, chosen().errors[0]);  // its law is right to a part
  const Gap gap = held_out_gap(*problem_, plain(), chosen());
  EXPECT_GT(gap.before, 1.5);
  EXPECT_GT(gap.closed, 0.9);
  EXPECT_EQ(gap.held_out.size(), 3U);
  EXPECT_GT(verdict_.log_pseudo_bayes_factor.value(), 20.0);
}

TEST_F(SimulatedSession, WithManySmallLossesOfStepsIsExplainedByThemAlone) {
  constexpr double lost_mL = 0.25;
  rig::ModelTerm losses{find_effect("missed-steps"), {}};
  for (const double time_s : {9.3, 20.0, 22.4, 26.1, 30.9, 34.4, 36.0})
    losses.change_points.push_back({"baseline", time_s, time_s});
  const double all_mL = lost_mL * static_cast<double>(losses.change_points.size());
  search(rig::simulated_session(family_, {.terms = {losses}, .values = {lost_mL, 0.02}, .seed = 7},
                                {0.0, "parabolic", 40.0, 1.2, 0.0, 30}),
         3);
  EXPECT_EQ(verdict_.verdict, Verdict::named);
  const auto effects = found_effects(*problem_, chosen(), verdict_);
  ASSERT_EQ(effects.size(), 1U);
  EXPECT_EQ(effects[0].id, "missed-steps");
  const auto moments = static_cast<double>(chosen().model.terms.front().change_points.size());
  EXPECT_NEAR(moments * effects[0].parameters.at(0).value, all_mL,
              1.5 * lost_mL);  // one may not be worth its choice
}

/// What it does to one waveform a function of volume does as well, which says nothing of where it comes from.
TEST_F(SimulatedSession, OfOneWaveformWithAStiffeningWallGetsNoName) {
  search({.terms = {{find_effect("strain-stiffening"), {}}}, .values = {1.4}, .seed = 6}, 1);
  EXPECT_GE(verdict_.confidence, 0.9);
  EXPECT_THAT(chosen().ids(), ElementsAre("strain-stiffening"));
  EXPECT_TRUE(is_settled(verdict_.searches));
  EXPECT_NEAR(verdict_.log_pseudo_bayes_factor.value() + std::log(effect_odds), 0.0, 1.0);
  EXPECT_EQ(verdict_.verdict, Verdict::ambiguous);
  EXPECT_THAT(verdict_.ambiguous_with, ElementsAre(testing::IsEmpty()));
}

TEST_F(SimulatedSession, WithALeakIsNotNamedByASearchThatDidNotSettle) {
  search({.terms = {{find_effect("cannula-leak-cavity"), {}}}, .values = {0.15}, .seed = 5});
  ASSERT_EQ(verdict_.verdict, Verdict::named);
  found_.sets[verdict_.chosen].termination = inference::Termination::iteration_limit;
  const SetVerdict unsettled = judge_sets(*problem_, found_, {});
  EXPECT_EQ(unsettled.verdict, Verdict::unexplained);
  EXPECT_FALSE(is_settled(unsettled.searches));
  EXPECT_EQ(unsettled.confidence, 0.5);
}

TEST_F(SimulatedSession, WithALeakIsNotNamedBesideALikelySetWhoseSearchDidNotSettle) {
  search({.terms = {{find_effect("cannula-leak-cavity"), {}}}, .values = {0.15}, .seed = 5});
  ASSERT_EQ(verdict_.verdict, Verdict::named);
  EffectSet drifting = plain();
  drifting.model.terms.push_back({find_effect("sensor-drift"), {}});
  drifting.model.values.push_back(100.0);
  WeighedSets made = found_;
  made.sets = {chosen(), drifting, plain()};
  made.probability = {0.93, 0.06, 0.01};
  made.sets[1].termination = inference::Termination::converged;
  ASSERT_EQ(judge_sets(*problem_, made, {}).verdict, Verdict::named);
  made.sets[1].termination = inference::Termination::iteration_limit;
  const SetVerdict open = judge_sets(*problem_, made, {});
  EXPECT_EQ(open.verdict, Verdict::ambiguous);
  EXPECT_THAT(open.ambiguous_with, ElementsAre(ElementsAre("sensor-drift")));
  EXPECT_FALSE(is_settled(open.searches));
}

TEST_F(SimulatedSession, WithALeakIsNotNamedIfTheSearchOfAFoldDidNotSettle) {
  search({.terms = {{find_effect("cannula-leak-cavity"), {}}}, .values = {0.15}, .seed = 5});
  ASSERT_EQ(verdict_.verdict, Verdict::named);
  found_.sets[verdict_.plain].evidence.shares.fill(1e100);  // farther than a search for them goes
  const SetVerdict unsettled = judge_sets(*problem_, found_, {});
  EXPECT_EQ(unsettled.verdict, Verdict::unexplained);
  EXPECT_EQ(unsettled.searches.back().termination, inference::Termination::iteration_limit);
  EXPECT_THAT(unsettled.searches.back().effects, ElementsAre("cannula-leak-cavity"));
}

TEST_F(SimulatedSession, WithALeakIsNotNamedByAReferenceWhoseSearchDidNotSettle) {
  search({.terms = {{find_effect("cannula-leak-cavity"), {}}}, .values = {0.15}, .seed = 5});
  ASSERT_EQ(judge_sets(*problem_, found_, {true}).verdict, Verdict::named);
  const SetVerdict unsettled = judge_sets(*problem_, found_, {true, inference::Termination::stalled});
  EXPECT_EQ(unsettled.verdict, Verdict::unexplained);
  ASSERT_EQ(unsettled.searches.size(), 3U);
  EXPECT_TRUE(unsettled.searches[1].of_reference);
}

}  // namespace
}  // namespace diastole::explain
