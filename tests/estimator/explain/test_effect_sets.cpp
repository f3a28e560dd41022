#include "estimator/explain/rig/effect_sets.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

TEST(SetRound, ASearchThatGoesOnWithoutEffectOnTheEvidenceHasConverged) {
  using enum inference::Termination;
  const SetRound later{.values = converged, .shares = converged, .moved_nats = 0.4};
  EXPECT_EQ(later.termination(), converged);
  for (const SetRound& endless :
       {SetRound{.values = iteration_limit, .shares = converged, .moved_nats = 0.4},
        SetRound{.values = stalled, .crept = true, .shares = converged, .moved_nats = 0.4}}) {
    EXPECT_TRUE(endless.is_at_rest());
    EXPECT_EQ(endless.termination(), converged);
    SetRound other = endless;
    other.is_first = true;
    EXPECT_EQ(other.termination(), endless.values);
    other = endless;
    other.moved_nats = 0.6;
    EXPECT_EQ(other.termination(), endless.values);
    other = endless;
    other.shares = iteration_limit;
    EXPECT_EQ(other.termination(), endless.values);
  }
}

TEST(SetRound, OfASearchThatSettledTheEvidenceHasToRest) {
  using enum inference::Termination;
  EXPECT_EQ((SetRound{.values = converged, .shares = converged, .moved_nats = 0.6}.termination()),
            iteration_limit);
  EXPECT_EQ((SetRound{.values = converged, .shares = stalled, .moved_nats = 0.1}.termination()),
            iteration_limit);
  EXPECT_EQ((SetRound{.values = stalled, .shares = converged, .moved_nats = 0.1}.termination()), stalled);
  EXPECT_FALSE((
      SetRound{.values = stalled, .shares = converged, .moved_nats = 0.1, .is_repeated = true}.is_at_rest()));
}

TEST(EffectSets, AnEffectIsWeighedAgainstTheToleranceThatDoesTheSame) {
  // The lag of the fluid near the hose's wall (sd 5 %) would have to weigh 24 % more.
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = rig::simulated_session(
      family, {.terms = {{find_effect("hose-inertance-excess"), {}}}, .values = {1.24}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  const WeighedSets search = search_sets(problem);
  const auto of = [&](const std::vector<std::string>& ids) {
    return std::ranges::find_if(search.sets, [&](const EffectSet& set) { return set.ids() == ids; });
  };
  const auto plain = of({}), excess = of({"hose-inertance-excess"});
  ASSERT_NE(plain, search.sets.end());
  ASSERT_NE(excess, search.sets.end());
  EXPECT_GT(excess->log_posterior, plain->log_posterior);
  EXPECT_NEAR(excess->model.values.front(), 1.24, 3.0 * excess->errors.front());
  EXPECT_LT(excess->errors.front(), 0.08);  // its tolerance's, mostly
}

TEST(EffectSets, WhereAllElseIsAsDescribedAPartThatIsOffIsNoTolerance) {
  // What three parts of a rig do in other sizes, all of them within their tolerances.
  const rig::SpecimenFamily family = rig::gel_family();
  rig::Session session = rig::simulated_session(
      family, {.terms = {{find_effect("stroke-gain"), {}}}, .values = {0.03}, .seed = 5});
  const auto probability_of_finer = [](const rig::SessionProblem& problem, const WeighedSets& search) {
    double sum = 0.0;
    for (size_t k = 0; k < search.sets.size(); ++k)
      if (problem.prior(search.sets[k].model).described.minCoeff() < 1.0) sum += search.probability[k];
    return sum;
  };
  const rig::SessionProblem fine(session, family, 2);
  const WeighedSets in_fine = search_sets(fine);
  EXPECT_EQ(in_fine.sets.front().ids(), std::vector<std::string>{"stroke-gain"});
  EXPECT_GT(probability_of_finer(fine, in_fine), 0.5);  // of three runs without a pump's sensor

  // Where the rig's description states how far its parts are off, none is finer.
  for (const rig::Tolerance& tolerance : rig::all_tolerances())
    if (tolerance.is_unknown == rig::IsUnknown::always)
      session.tolerance_sd[std::string(tolerance.name)] = tolerance.sd;
  const rig::SessionProblem stated(session, family, 2);
  EXPECT_EQ(probability_of_finer(stated, search_sets(stated)), 0.0);
}

}  // namespace
}  // namespace diastole::explain
