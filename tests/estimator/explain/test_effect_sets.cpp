#include "estimator/explain/rig/effect_sets.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

TEST(EffectSets, AnEffectIsWeighedAgainstTheToleranceThatDoesTheSame) {
  // The lag of the fluid near the hose's wall (sd 5 %) would have to weigh 24 % more.
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = rig::simulated_session(
      family, {.terms = {{find_effect("hose-inertance-excess"), {}}}, .values = {1.24}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  const SetSearch search = search_sets(problem);
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
  const auto is_finer = [](const rig::SessionProblem& problem, const EffectSet& set) {
    return problem.prior(set.model).described.minCoeff() < 1.0;
  };
  const rig::SessionProblem fine(session, family, 2);
  const SetSearch in_fine = search_sets(fine);
  EXPECT_EQ(in_fine.sets.front().ids(), std::vector<std::string>{"stroke-gain"});
  EXPECT_TRUE(is_finer(fine, in_fine.sets.front()));
  EXPECT_GT(in_fine.probability.front(), 0.9);

  // The same recordings of a rig whose description is as wrong as tolerances are.
  session.base.hose.wave_speed_m_s *= 1.2;
  session.base.hose.bore_mm *= 0.985;
  session.base.catheter.resonance_Hz *= 0.8;
  session.base.catheter.damping *= 1.3;
  session.base.hose.loss_coefficient *= 1.4;
  const rig::SessionProblem coarse(session, family, 2);
  const SetSearch in_coarse = search_sets(coarse);
  EXPECT_FALSE(is_finer(coarse, in_coarse.sets.front()));
}

}  // namespace
}  // namespace diastole::explain
