// Recordings of an independent program (tests/data/rig), explained end to end.

#include <gmock/gmock.h>

#include "estimator/explain/rig/explain_rig.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::explain {
namespace {

Explanation explained(const std::string& name) {
  const auto folder = test::recorded("rig/" + name);
  return explain_rig(read_study(folder / (name + ".study.toml")),
                     {.threads = 2, .propose = false, .progress = {}});
}

TEST(RecordedExplanations, NothingIsNamedWhereNothingIsHidden) {
  const Explanation found = explained("case-030");
  EXPECT_EQ(found.verdict, Verdict::none);
  EXPECT_TRUE(found.effects.empty());
}

TEST(RecordedExplanations, ASoftHoseIsNamedWithItsWaveSpeed) {
  const Explanation found = explained("case-054");
  EXPECT_EQ(found.verdict, Verdict::named);
  ASSERT_EQ(found.effects.size(), 1U);
  EXPECT_EQ(found.effects[0].id, "hose-compliance");
  EXPECT_NEAR(found.effects[0].parameters.at(0).value, 46.12, 0.2);
  EXPECT_GT(found.gap.closed, 0.95);
  ASSERT_FALSE(found.where.empty());
  EXPECT_EQ(found.where.front().port, "drive");
}

}  // namespace
}  // namespace diastole::explain
