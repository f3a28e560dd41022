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

}  // namespace
}  // namespace diastole::explain
