// Every effect is found again in recordings that the model made with it, and is silent in those made without. Data and
// estimates share one model: the tests are of the searches, not of the physics.

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "estimator/explain/rig/effect_responses.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "tests/estimator/rig_fit/simulated_session.hpp"

namespace diastole {
namespace {

class EveryEffect : public testing::TestWithParam<const Effect*> {
 protected:
  [[nodiscard]] static explain::EffectSet without(const rig::SessionProblem& problem) {
    const rig::LinearisedModel base = rig::declared_rig(problem);
    return explain::fit_set_exactly(problem,
                                    explain::fit_set(problem, base.at, base, problem.error().prior.share));
  }
  /// The best from several sizes.
  [[nodiscard]] explain::EffectSet with(const rig::SessionProblem& problem) const {
    const rig::LinearisedModel base = rig::declared_rig(problem);
    const std::vector<double> neutral = GetParam()->neutral(problem.model(base.at));
    std::optional<explain::EffectSet> best;
    for (const double size : {0.5, 1.0, 2.0}) {
      rig::SessionModel start = base.at;
      start.terms = terms_;
      for (size_t j = 0; j < neutral.size(); ++j) {
        const EffectParameter& parameter = GetParam()->parameters()[j];
        start.values.push_back(
            explain::is_amplitude(*GetParam(), j)
                ? std::clamp(rig::sized_value(parameter, neutral[j], size), parameter.lower, parameter.upper)
                : parameter.typical);
      }
      explain::EffectSet set = explain::fit_set(problem, start, base, problem.error().prior.share);
      if (!best || set.log_posterior > best->log_posterior) best = std::move(set);
    }
    return explain::fit_set_exactly(problem, *best);
  }
  rig::SpecimenFamily family_ = rig::gel_family();
  std::vector<rig::ModelTerm> terms_{{GetParam(), GetParam()->change_points() == ChangePoints::none
                                                      ? std::vector<ChangePoint>{}
                                                      : std::vector<ChangePoint>{{"baseline", 3.1, 3.1}}}};
};

TEST_P(EveryEffect, IsFoundAgain) {
  rig::SessionOptions options{.terms = terms_};
  for (const EffectParameter& parameter : GetParam()->parameters())
    options.values.push_back(parameter.typical);
  options.values.front() =
      GetParam()->neutral({}).front() + 0.8 * (options.values.front() - GetParam()->neutral({}).front());
  const rig::Session session = rig::simulated_session(family_, options);
  const rig::SessionProblem problem(session, family_, 2);
  const explain::EffectSet found = with(problem);
  EXPECT_TRUE(inference::is_settled(found.termination)) << inference::sentence(found.termination);
  EXPECT_NEAR(found.model.values[0], options.values[0],
              5.0 * found.errors[0] + 0.02 * std::abs(options.values[0]));
}

TEST_P(EveryEffect, IsSilentWithoutCause) {
  const rig::Session session = rig::simulated_session(family_, {.seed = 7});
  const rig::SessionProblem problem(session, family_, 2);
  EXPECT_LT(with(problem).log_posterior, without(problem).log_posterior);
}

std::string test_name(const testing::TestParamInfo<const Effect*>& info) {
  std::string name(info.param->text().id);
  std::erase(name, '-');
  return name;
}

INSTANTIATE_TEST_SUITE_P(List, EveryEffect, testing::ValuesIn(rig_effects()), test_name);

}  // namespace
}  // namespace diastole
