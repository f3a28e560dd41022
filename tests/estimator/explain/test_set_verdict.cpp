#include "estimator/explain/rig/set_verdict.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

TEST(SetVerdict, NothingIsWrongOnlyByAModelThatTheDataDoNotExclude) {
  const rig::SpecimenFamily family = rig::gel_family();
  const rig::Session session = rig::simulated_session(family, {.terms = {}, .values = {}, .seed = 5});
  const rig::SessionProblem problem(session, family, 2);
  const SetSearch search = search_sets(problem);
  const auto plain = std::ranges::find_if(search.sets, [&](const EffectSet& set) {
    return set.ids().empty() && problem.prior(set.model).described.minCoeff() == 1.0;
  });
  ASSERT_NE(plain, search.sets.end());
  // With an effect that is far too small for a name, and a part of the rig that is too far off to be a tolerance.
  EffectSet strained = *plain;
  strained.model.terms.push_back({find_effect("sensor-gain"), {}});
  strained.model.values.push_back(1e-6);
  strained.model.u.tail(1)[0] = 5.0;
  SetSearch made = search;
  made.sets = {strained, *plain};
  const auto verdict = [&](double without) {
    made.probability = {1.0 - without, without};
    return judge_sets(problem, made, {}).verdict;
  };
  EXPECT_EQ(verdict(0.2), Verdict::none);
  EXPECT_EQ(verdict(1e-9), Verdict::unexplained);
}

}  // namespace
}  // namespace diastole::explain
