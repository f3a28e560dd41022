// Every effect is found again in recordings that the model made with it, and is silent in those made without. Data and
// estimates share one model: the tests are of the searches, not of the physics.

#include <gtest/gtest.h>

#include "estimator/explain/rig/effect_trial.hpp"
#include "tests/estimator/effects/effect_name.hpp"

namespace diastole {
namespace {

class EveryEffect : public testing::TestWithParam<const Effect*> {
 protected:
  explain::EffectTrial trial_{*GetParam()};
};

TEST_P(EveryEffect, IsFoundAgain) {
  const explain::EffectCheck check = trial_.found_again();
  EXPECT_TRUE(check.passed) << check.detail;
}

TEST_P(EveryEffect, IsSilentWithoutCause) {
  const explain::EffectCheck check = trial_.silent();
  EXPECT_TRUE(check.passed) << check.detail;
}

INSTANTIATE_TEST_SUITE_P(List, EveryEffect, testing::ValuesIn(rig_effects()), test_name);

}  // namespace
}  // namespace diastole
