// Recordings of an independent program (tests/data/rig), explained end to end.

#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/explain/rig/explain_rig.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::explain {
namespace {

Explanation explained(const std::string& name, const std::vector<std::filesystem::path>& files = {}) {
  const auto folder = test::recorded("rig/" + name);
  Study study = read_study(folder / (name + ".study.toml"));
  study.effect_files = files;
  return explain_rig(study, {.threads = 2, .propose = false, .progress = {}});
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

/// Every built-in effect that examples/effects expresses gives way to its file.
TEST(RecordedExplanations, FilesGiveTheVerdictsOfTheEffectsThatTheyExpress) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(DIASTOLE_SOURCE_DIR "/examples/effects"))
    if (entry.path().filename() != "my-seal.effect.toml") files.push_back(entry.path());
  for (const char* name : {"case-003", "case-028", "case-030", "case-054"}) {
    const Explanation built_in = explained(name);
    const Explanation by_files = explained(name, files);
    EXPECT_EQ(by_files.verdict, built_in.verdict) << name;
    EXPECT_EQ(by_files.ambiguous_with, built_in.ambiguous_with) << name;
    ASSERT_EQ(by_files.effects.size(), built_in.effects.size()) << name;
    for (size_t i = 0; i < built_in.effects.size(); ++i) {
      EXPECT_EQ(by_files.effects[i].id, built_in.effects[i].id) << name;
      const FoundParameter& a = by_files.effects[i].parameters.at(0);
      const FoundParameter& b = built_in.effects[i].parameters.at(0);
      EXPECT_NEAR(a.value, b.value, 0.1 * b.standard_error) << name << ", " << b.name;
    }
  }
}

}  // namespace
}  // namespace diastole::explain
