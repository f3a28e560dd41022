// `diastole explain`, the program, on recordings of independent programs from two worlds (tests/data/rig: exact models;
// tests/data/rig2: parts with tolerances), in which is known what was hidden; and on the session of tools/demo, recorded on the
// project's own simulated rig.

#include <gmock/gmock.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/changed_run.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/recorded_data.hpp"

namespace diastole {
namespace {

struct Case {
  std::string name;  ///< folder and file: "rig/case-054", or an absolute path
  std::string what;  ///< "SoftHose"
  std::vector<std::string> verdicts;
  std::vector<std::string> effects;  ///< if it is named
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

nlohmann::json explained(const Case& one, const std::string& options = "") {
  const std::filesystem::path folder = test::recorded(one.name);
  const std::filesystem::path out = std::filesystem::path(testing::TempDir()) / one.what;
  const std::string command = "\"" DIASTOLE_BIN_DIR "/diastole\" explain \"" +
                              (folder / (folder.filename().string() + ".study.toml")).string() + "\" -o \"" +
                              out.string() + "\" --json " + options + " 2>&1 >\"" + out.string() + ".json\"";
  std::filesystem::remove_all(out);
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::FILE* file = std::fopen((out.string() + ".json").c_str(), "r");
  if (file == nullptr) return {};
  nlohmann::json json = nlohmann::json::parse(file, nullptr, false);
  std::fclose(file);
  return json;
}

class ExplainedRecording : public testing::TestWithParam<Case> {};

TEST_P(ExplainedRecording, GetsTheAnswerThatIsTrue) {
  const nlohmann::json found = explained(GetParam());
  ASSERT_TRUE(found.is_object());
  const auto verdict = found.at("verdict").get<std::string>();
  EXPECT_THAT(GetParam().verdicts, testing::Contains(verdict)) << found.at("summary");
  std::vector<std::string> ids;
  for (const auto& effect : found.at("effects"))
    ids.push_back(effect.at("id").get<std::string>());
  if (verdict == "named") {
    EXPECT_THAT(ids, testing::UnorderedElementsAreArray(GetParam().effects));
    EXPECT_GE(found.at("confidence").get<double>(), 0.9);
    EXPECT_GT(found.at("gap").at("closed").get<double>(), 0.5);
  } else if (verdict == "ambiguous") {
    EXPECT_THAT(ids, testing::UnorderedElementsAreArray(GetParam().effects));
  } else {
    EXPECT_THAT(ids, testing::IsEmpty());
  }
}

TEST(ExplainedRecordings, TeachNoLawWhereNothingIsMissing) {
  const nlohmann::json found = explained({"rig/case-030", "NothingToLearn", {}, {}}, "--learn");
  ASSERT_TRUE(found.is_object());
  EXPECT_EQ(found.at("verdict"), "none");
  EXPECT_TRUE(found.at("learned").is_null());
  EXPECT_EQ(found.at("not_learned"), "nothing exceeds the model's own error");
}

TEST(ExplainedRecordings, SayWhereThePistonsMotionWasSmoothed) {
  const test::ScratchFolder folder;
  const std::filesystem::path session = folder.path() / "case-030";
  std::filesystem::copy(test::recorded("rig/case-030"), session, std::filesystem::copy_options::recursive);
  test::wobble_steps(session / "baseline.run.h5");
  const nlohmann::json found = explained({session.string(), "SmoothedMotion", {}, {}});
  ASSERT_TRUE(found.is_object());
  EXPECT_THAT(found.at("summary").get<std::string>(),
              testing::HasSubstr("No motion that is known follows the counted steps of baseline: they were "
                                 "smoothed, and are up to 0.1"));
}

INSTANTIATE_TEST_SUITE_P(
    Worlds, ExplainedRecording,
    testing::Values(Case{"rig/case-030", "OneRunWithNothingHidden", {"none"}, {}},
                    Case{"rig/case-009", "NothingHidden", {"none"}, {}},
                    Case{"rig/case-054", "SoftHose", {"named"}, {"hose-compliance"}},
                    Case{DIASTOLE_SOURCE_DIR "/examples/paper-gap",
                         "ASoftHoseBehindAThrottle",
                         {"named"},
                         {"hose-compliance", "hose-loss-excess"}},
                    Case{"rig2/r2-07", "NothingHiddenInARealRig", {"none", "unexplained"}, {}},
                    Case{"rig2/r2-06", "Leak", {"named"}, {"cannula-leak-cavity"}},
                    Case{"rig2/r2-08", "Softening", {"named"}, {"stress-softening"}},
                    Case{"rig2/r2-10", "Relaxation", {"named"}, {"viscoelasticity"}},
                    Case{"rig2/r2-02", "WarmingAndDrift", {"named"}, {"temperature-drift", "sensor-drift"}},
                    Case{"rig2/r2-09", "AWallThatNoEffectKnows", {"unexplained"}, {}},
                    Case{"rig2/r2-03", "BackPressureThatOneRunDoesNotTell", {"none", "unexplained"}, {}},
                    Case{"rig2/r3-04",
                         "StiffeningThatOneRunDoesNotTell",
                         {"none", "unexplained", "ambiguous"},
                         {"strain-stiffening"}}),
    [](const auto& made) { return made.param.what; });

}  // namespace
}  // namespace diastole
