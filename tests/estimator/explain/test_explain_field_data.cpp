// Explanations of recordings that an independent solver made (two of them in tests/data/fe). The others are
// skipped where they are absent.

#include <gtest/gtest.h>

#include <filesystem>

#include "estimator/explain/imaging/explain_field.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::explain {
namespace {

struct Known {
  const char* study;
  Verdict verdict;
  const char* id;  ///< among the effects, or those it cannot be told from
};

class RecordedField : public testing::TestWithParam<Known> {};

TEST_P(RecordedField, IsExplained) {
  const std::filesystem::path study = test::recorded(std::string("fe/") + GetParam().study);
  if (!std::filesystem::exists(study)) GTEST_SKIP() << study << " is not there";
  const Explanation explanation = explain_field(read_study(study));
  EXPECT_EQ(name_of(explanation.verdict), name_of(GetParam().verdict)) << explanation.summary;
  std::vector<std::string> ids;
  for (const FoundEffect& effect : explanation.effects)
    ids.push_back(effect.id);
  for (const auto& set : explanation.ambiguous_with)
    ids.push_back(set.front());
  if (*GetParam().id != '\0') {
    EXPECT_NE(std::ranges::find(ids, GetParam().id), ids.end()) << explanation.summary;
  } else {
    EXPECT_TRUE(ids.empty()) << explanation.summary;
  }
}

INSTANTIATE_TEST_SUITE_P(Sets, RecordedField,
                         testing::Values(Known{"field-001.study.toml", Verdict::unexplained, ""},
                                         Known{"field-003.study.toml", Verdict::named, "stiff-inclusion"},
                                         Known{"field-004-shear.study.toml", Verdict::ambiguous,
                                               "chamber-back-pressure"},
                                         Known{"field-007.study.toml", Verdict::none, ""},
                                         Known{"field-011.study.toml", Verdict::named, "end-bond-slip"}));

}  // namespace
}  // namespace diastole::explain
