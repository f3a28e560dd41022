// What every effect of the list must keep.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "estimator/explain/rig/effect_trial.hpp"
#include "tests/estimator/effects/effect_name.hpp"
#include "tools/benchmarks/verification/effects_page.hpp"

namespace diastole {
namespace {

class EveryEffect : public testing::TestWithParam<const Effect*> {
 protected:
  explain::EffectTrial trial_{*GetParam()};
};

TEST_P(EveryEffect, TellsEverything) {
  const explain::EffectCheck check = trial_.declared();
  EXPECT_TRUE(check.passed) << check.detail;
  const EffectDeclaration& text = GetParam()->text();
  for (const auto& others : {text.conflicts, text.synergies})
    for (const std::string_view other : others)
      EXPECT_NE(find_effect(other), nullptr) << other;
}

TEST_P(EveryEffect, IsTheBaseModelExactlyWhereNeutral) {
  const explain::EffectCheck check = trial_.neutral();
  EXPECT_TRUE(check.passed) << check.detail;
}

TEST_P(EveryEffect, ShowsWhereItIsTypical) {
  const explain::EffectCheck check = trial_.shows();
  EXPECT_TRUE(check.passed) << check.detail;
}

TEST_P(EveryEffect, IsFiniteAtItsBounds) {
  const explain::EffectCheck check = trial_.bounded();
  EXPECT_TRUE(check.passed) << check.detail;
}

TEST_P(EveryEffect, HasTheGradientThatTheFitTakes) {
  const explain::EffectCheck check = trial_.differentiable();
  EXPECT_TRUE(check.passed) << check.detail;
}

INSTANTIATE_TEST_SUITE_P(List, EveryEffect, testing::ValuesIn(rig_effects()), test_name);

TEST(Effects, AreThePageOfTheDocuments) {
  std::ifstream file(DIASTOLE_SOURCE_DIR "/docs/effects.md");
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(page, effects_page()) << "build/release/bin/effects_table > docs/effects.md";
}

/// The search for an inclusion sets an Inclusion's seven parameters in their order.
TEST(Effects, HaveOneInclusion) {
  EXPECT_EQ(std::ranges::count_if(all_effects(), &Effect::is_inclusion), 1);
  FieldModel model;
  inclusion_effect().apply_to_field(std::vector{2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0}, model);
  EXPECT_EQ(model.inclusion, (Inclusion{2.0, 3.0, 4.0, 5.0, {6.0, 7.0, 8.0}}));
}

TEST(Effects, HaveEachTheirId) {
  std::set<std::string_view> ids;
  for (const Effect* effect : all_effects())
    EXPECT_TRUE(ids.insert(effect->text().id).second) << effect->text().id;
  EXPECT_EQ(find_effect("no-such-effect"), nullptr);
}

}  // namespace
}  // namespace diastole
