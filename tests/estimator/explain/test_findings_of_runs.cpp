// What an explanation of runs says of a fitted set.

#include <gtest/gtest.h>

#include "estimator/explain/rig/findings.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

/// The hose's ends lose less than declared, which an excess of loss cannot do.
TEST(FoundEffects, AValueOnItsBoundHasAnInterval) {
  const rig::SpecimenFamily family = rig::gel_family();
  const Effect& excess = *find_effect("hose-loss-excess");
  const rig::Session session =
      rig::simulated_session(family, {.terms = {{&excess, {}}}, .values = {-1.0}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  const rig::LinearisedModel base = rig::declared_rig(problem);
  rig::SessionModel start = base.at;
  start.terms = {{&excess, {}}};
  start.values = {5.0};
  const EffectSet set = fit_set_exactly(problem, fit_set(problem, start, base, problem.error().prior.share));
  ASSERT_EQ(set.model.values.front(), excess.parameters().front().lower);
  SetVerdict verdict;
  verdict.size_over_error = {3.0};
  verdict.material = {true};
  const FoundParameter found = found_effects(problem, set, verdict).at(0).parameters.at(0);
  EXPECT_EQ(found.ci90[0], found.value);
  EXPECT_GT(found.ci90[1], found.value + 0.05);
  EXPECT_LT(found.ci90[1], 0.5 * excess.parameters().front().upper);
}

}  // namespace
}  // namespace diastole::explain
