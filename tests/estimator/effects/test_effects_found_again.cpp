// Every effect is found again in recordings that the model made with it, and is silent in those made without.

#include <gtest/gtest.h>

#include "tests/estimator/rig_fit/simulated_session.hpp"

namespace diastole {
namespace {

class EveryEffect : public testing::TestWithParam<const Effect*> {
 protected:
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
  const rig::RigProblem problem(session, family_);
  const rig::RigFit fit = problem.fit(terms_);
  EXPECT_NEAR(fit.reduced(), 1.0, 0.06);
  EXPECT_LE(fit.chi_square, problem.base().chi_square + 1.0);
  EXPECT_NEAR(fit.values[3], options.values[0], 5.0 * fit.errors[3] + 0.02 * std::abs(options.values[0]));
}

TEST_P(EveryEffect, IsSilentWithoutCause) {
  const rig::Session session = rig::simulated_session(family_, {.seed = 7});
  const rig::RigProblem problem(session, family_);
  const rig::RigFit fit = problem.fit(terms_);
  const double gained = problem.base().chi_square - fit.chi_square;
  const double expected = static_cast<double>(GetParam()->parameters().size());
  EXPECT_LT(gained, 12.0 + 4.0 * expected);
}

std::string test_name(const testing::TestParamInfo<const Effect*>& info) {
  std::string name(info.param->text().id);
  std::erase(name, '-');
  return name;
}

INSTANTIATE_TEST_SUITE_P(List, EveryEffect, testing::ValuesIn(rig_effects()), test_name);

}  // namespace
}  // namespace diastole
