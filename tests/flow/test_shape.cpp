// The specimen follows a curve, by whole programs: docs/shape.md.

#include <gmock/gmock.h>

#include <filesystem>

#include "tests/flow/rig_with_daemon.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::filesystem::path example = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/shape";

std::vector<std::string> shaped(std::vector<std::string> words, const std::string& cycles = "9") {
  for (const std::string& word : {std::string("--study"), (example / "gel.study.toml").string(),
                                  std::string("--cycles"), cycles, std::string("--json")})
    words.push_back(word);
  return words;
}

const std::string wanted = (example / "ventricle.csv").string();

TEST(ShapeFlow, LearnsOnTheSimulatedRigAndKeepsTheBest) {
  const Workplace place;
  const Ended ended =
      run(place, shaped({"diastole", "simulate", "--shape", wanted, "-o", "followed.run.h5", "--iterations",
                         "2", "--gated-volume", "0.05", "--hide", "stroke-gain", "--page", "followed.html"}));
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const json found = ended.json();
  ASSERT_EQ(found.at("iterations").size(), 2U);
  EXPECT_GT(found["iterations"][0].at("nrmse"), 0.01);
  EXPECT_LT(found["iterations"][1].at("nrmse"), 0.01);
  EXPECT_EQ(found["iterations"][1].at("source"), "gated volume");
  EXPECT_EQ(found.at("best"), 1);
  EXPECT_EQ(found.at("drive"), "followed.2.csv");
  EXPECT_EQ(found.at("followed"), true);
  EXPECT_TRUE(std::filesystem::exists(place / "followed.html"));
  // The same by files.
  const Ended after = run(place, shaped({"diastole", "shape", wanted, "-o", "next.csv", "--after",
                                         "followed.1.run.h5", "followed.2.run.h5"}));
  ASSERT_EQ(after.exit_code, 0) << after.err;
  EXPECT_EQ(after.json().at("nrmse"), found.at("nrmse"));
}

TEST(ShapeFlow, TakesAStudyWithEffectsOfAUsersOwn) {
  const Workplace place;
  std::string study = source_text("examples/shape/gel.study.toml");
  study = with(study, "../paper-gap/paper-gap.run.h5",
               (example / "../paper-gap/paper-gap.run.h5").lexically_normal().string());
  study = with(study, "effects = []",
               "effects = [\"my-seal\"]\neffect_files = [\"" +
                   (example / "../effects/my-seal.effect.toml").lexically_normal().string() +
                   "\"]\n[model.parameters.my-seal.G]\nstart = 0.02");
  place.write("own.study.toml", study);
  const Ended ended = run(place, {"diastole", "shape", wanted, "--study", "own.study.toml", "-o", "drive.csv",
                                  "--cycles", "9", "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_GT(ended.json().at("nrmse").get<double>(), 0.0);
}

TEST(ShapeFlow, StopsWhenTheSpecimenBeginsToLeakInARun) {
  const Workplace place;
  const Ended ended = run(
      place, shaped({"diastole", "simulate", "--shape", wanted, "-o", "leak.run.h5", "--fault", "leak@run+9"},
                    "12"));
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  const json found = ended.json();
  EXPECT_EQ(found.at("ending"), "changed");
  EXPECT_EQ(found.at("runs").size(), 1U) << "it went on pushing";
  EXPECT_TRUE(found.at("drive").is_null());
  const Ended after =
      run(place, shaped({"diastole", "shape", wanted, "-o", "next.csv", "--after", "leak.1.run.h5"}));
  EXPECT_EQ(after.exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(place / "next.csv"));
}

/// Three times as fast as the example, of which the pump's limits leave another curve.
TEST(ShapeFlow, SaysWhenTheNearestDriveIsFarFromTheCurve) {
  const Workplace place;
  place.write("fast.csv", "time_s,volume_mL\n0,0\n0.05,1\n0.2,18\n0.3,24\n0.35,12\n0.4,0\n");
  const Ended far = run(place, shaped({"diastole", "shape", "fast.csv", "-o", "drive.csv"}));
  EXPECT_EQ(far.exit_code, 1) << far.err;
  const json found = far.json();
  EXPECT_GT(found.at("drive_nrmse"), 0.05);
  EXPECT_EQ(found.at("tolerance"), 0.05);
  EXPECT_EQ(found.at("followed"), false);
  EXPECT_TRUE(std::filesystem::exists(place / "drive.csv")) << "it is the nearest";
  EXPECT_THAT(far.err, HasSubstr("With this drive the specimen misses the curve by "));
  EXPECT_THAT(far.err, HasSubstr("5 % are allowed (--tolerance-percent)"));

  const Ended allowed =
      run(place, shaped({"diastole", "shape", "fast.csv", "-o", "drive.csv", "--tolerance-percent", "50"}));
  EXPECT_EQ(allowed.exit_code, 0) << allowed.err;
  EXPECT_EQ(allowed.json().at("followed"), true);
}

TEST(ShapeFlow, RunsThroughTheDaemon) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  {
    DaemonClient client = rig.client();
    home(client);
  }
  const Ended ended = run(rig.place, shaped({"diastole", "run", "--shape", wanted, "--iterations", "2", "-o",
                                             "live.run.h5", "--socket", rig.path("socket")}));
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const json found = ended.json();
  ASSERT_EQ(found.at("iterations").size(), 2U);
  EXPECT_LT(found["iterations"][1].at("nrmse"), found["iterations"][0].at("nrmse"));
  EXPECT_TRUE(std::filesystem::exists(rig.place / "live.2.run.h5"));
}

TEST(ShapeFlow, RefusesWhatCannotBe) {
  const Workplace place;
  place.write("high.csv", "time_s,volume_mL\n0,5\n0.5,7\n0.8,1\n1.2,5\n");
  const Ended high = run(place, shaped({"diastole", "shape", "high.csv", "-o", "drive.csv"}));
  EXPECT_EQ(high.exit_code, 2);
  EXPECT_THAT(high.err, HasSubstr("high.csv: line 4"));
  const Ended nothing = run(place, {"diastole", "run", "-o", "x.run.h5"});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("--shape"));
  const Ended no_study = run(place, {"diastole", "simulate", "--shape", wanted, "-o", "x.run.h5"});
  EXPECT_EQ(no_study.exit_code, 2);
  EXPECT_THAT(no_study.err, HasSubstr("--study"));
  place.write("large.csv", "time_s,volume_mL\n0,0\n0.4,2000\n0.8,800\n1.2,0\n");
  const Ended large = run(place, shaped({"diastole", "simulate", "--shape", "large.csv", "-o", "x.run.h5"}));
  EXPECT_EQ(large.exit_code, 2);
  EXPECT_THAT(large.err, HasSubstr("large.csv: line 3: asks for 2000 mL"));
  const Ended negative =
      run(place, shaped({"diastole", "shape", wanted, "-o", "drive.csv", "--period-s", "-1"}));
  EXPECT_EQ(negative.exit_code, 2);
  EXPECT_THAT(negative.err, HasSubstr("--period-s: -1 is not above zero"));
  const Ended other =
      run(place, shaped({"diastole", "shape", wanted, "-o", "drive.csv", "--after",
                         std::string(DIASTOLE_SOURCE_DIR) + "/examples/recorded-baseline.run.h5"}));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("/protocol/segments"));
  EXPECT_FALSE(std::filesystem::exists(place / "drive.csv"));
}

/// "Nobody answers" was what a forgotten study got.
TEST(ShapeFlow, ReadsStudyAndCurveBeforeTheDaemonIsAsked) {
  const Workplace place;
  const auto live = [&](const std::string& target, const std::vector<std::string>& more) {
    std::vector<std::string> words{"diastole", "run",      "--shape",  target,
                                   "-o",       "x.run.h5", "--socket", "nobody"};
    words.insert(words.end(), more.begin(), more.end());
    return run(place, words);
  };
  const Ended no_study = live(wanted, {});
  EXPECT_EQ(no_study.exit_code, 2);
  EXPECT_THAT(no_study.err, HasSubstr("option --study: is missing"));
  const Ended other_study = live(wanted, {"--study", "other.study.toml"});
  EXPECT_EQ(other_study.exit_code, 2);
  EXPECT_THAT(other_study.err, HasSubstr("other.study.toml"));
  const Ended no_curve = live("other.csv", {"--study", (example / "gel.study.toml").string()});
  EXPECT_EQ(no_curve.exit_code, 2);
  EXPECT_THAT(no_curve.err, HasSubstr("other.csv"));
  const Ended nobody = live(wanted, {"--study", (example / "gel.study.toml").string()});
  EXPECT_EQ(nobody.exit_code, 3);
  EXPECT_FALSE(std::filesystem::exists(place / "x.1.csv")) << "it is written before there is a rig";
}

}  // namespace
}  // namespace diastole::flow
