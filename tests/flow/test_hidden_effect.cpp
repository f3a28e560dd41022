// The loop of docs/hidden-effects.md by whole programs: the simulated rig hides something, explain says what, the score
// says whether that was right.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "tests/flow/programs.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::IsEmpty;

const std::filesystem::path example = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/hidden-effect";

std::vector<std::string> ids(const json& explanation) {
  std::vector<std::string> list;
  for (const json& effect : explanation.at("effects"))
    list.push_back(effect.at("id"));
  return list;
}

class Hidden : public testing::Test {
 protected:
  /// Explains a session of rig 1, or of the very rig that its file describes, in which this is hidden.
  json explained(const std::string& name, const std::string& effect, const std::string& seed,
                 bool is_as_described = false) {
    std::filesystem::create_directories(workplace_ / "sealed");
    std::filesystem::create_directories(workplace_ / "results");
    std::vector<std::string> simulate{"diastole",
                                      "simulate",
                                      (example / "mine.experiment.toml").string(),
                                      "-o",
                                      name + ".run.h5",
                                      "--seed",
                                      seed,
                                      "--hide",
                                      effect,
                                      "--sealed",
                                      "sealed/" + name + ".sealed.json"};
    if (!is_as_described) simulate.insert(simulate.end(), {"--rig-seed", "1"});
    const Ended simulated = run(workplace_, simulate);
    EXPECT_EQ(simulated.exit_code, 0) << simulated.err;
    std::ifstream file(example / "mine.study.toml");
    std::string study{std::istreambuf_iterator<char>(file), {}};
    study.replace(study.find("mine.run.h5"), 11, name + ".run.h5");
    workplace_.write(name + ".study.toml", study);
    const Ended ended =
        run(workplace_, {"diastole", "explain", name + ".study.toml", "-o", "results/" + name, "--json"});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return ended.json();
  }
  Workplace workplace_;
};

TEST_F(Hidden, IsFoundAndScored) {
  EXPECT_EQ(explained("nothing", "none", "1").at("verdict"), "none");
  EXPECT_EQ(explained("described", "none", "1", true).at("verdict"), "none");
  const json leak = explained("leak", "cannula-leak-cavity", "2");
  EXPECT_EQ(leak.at("verdict"), "named");
  EXPECT_THAT(ids(leak), ElementsAre("cannula-leak-cavity"));
  const json soft = explained("soft", "hose-compliance", "3");
  EXPECT_EQ(soft.at("verdict"), "named");
  EXPECT_THAT(ids(soft), ElementsAre("hose-compliance"));
  // Of no library: cycles differ by more than the noise.
  EXPECT_THAT(ids(explained("hum", "outside:mains-hum", "4")), IsEmpty());

  const Ended scored = run(workplace_, {"diastole", "explain", "--score", "sealed", "results", "--json"});
  EXPECT_EQ(scored.exit_code, 0) << scored.out;
  const json score = scored.json();
  EXPECT_EQ(score.at("passed"), true);
  for (const json& cell : score.at("confusion"))
    EXPECT_TRUE(cell.at("right").get<bool>()) << cell;
}

TEST_F(Hidden, AModulusBeyondTheStudysBoundsIsToldAndKept) {
  (void)explained("soft", "hose-compliance", "3");
  std::ifstream file(workplace_ / "soft.study.toml");
  const std::string study{std::istreambuf_iterator<char>(file), {}};
  workplace_.write("narrow.study.toml", with(with(study, "bounds = [1.0, 20.0]", "bounds = [1.0, 5.0]"),
                                             "start = 8.8", "start = 3.0"));
  const Ended ended = run(workplace_, {"diastole", "explain", "narrow.study.toml", "-o", "narrow"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_THAT(ended.err, testing::HasSubstr("outside its bounds [1, 5]"));
  workplace_.write("pascals.study.toml",
                   with(with(study, "bounds = [1.0, 20.0]", "bounds = [1000.0, 20000.0]"), "start = 8.8",
                        "start = 8800.0"));
  const Ended doubted =
      run(workplace_, {"diastole", "explain", "pascals.study.toml", "-o", "pascals", "--json"});
  EXPECT_THAT(doubted.json().at("summary").get<std::string>(), testing::HasSubstr("is its stiffness in kPa"));
}

}  // namespace
}  // namespace diastole::flow
