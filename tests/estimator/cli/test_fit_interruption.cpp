#include <gmock/gmock.h>

#include <csignal>

#include "estimator/io/whole_file.hpp"
#include "tests/flow/programs.hpp"

namespace diastole {
namespace {

TEST(FitInterruption, CtrlCLeavesAWholeCheckpointAndSaysHowToGoOn) {
  const flow::Workplace place;
  const std::string study = DIASTOLE_SOURCE_DIR "/examples/phantom-a.study.toml";
  flow::Program fit(place,
                    {"diastole", "fit", study, "--checkpoint", "gel.checkpoint.json", "--set", "C1_kPa=4"});
  ASSERT_TRUE(fit.wait_for_text("iteration  0")) << fit.err();
  fit.signal(SIGINT);
  const flow::Ended ended = fit.wait();
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  EXPECT_THAT(ended.err,
              testing::AllOf(testing::HasSubstr("Stopped on request"), testing::HasSubstr("--resume")));
  const flow::Ended resumed = flow::run(
      place, {"diastole", "fit", study, "--checkpoint", "gel.checkpoint.json", "--resume", "--json"});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_NEAR(resumed.json().at("parameters").at("C1_kPa").at("value").get<double>(), 8.57, 0.02);
}

TEST(FitInterruption, ACheckpointOfAnotherFitIsNotTakenUp) {
  const flow::Workplace place;
  const std::string study = DIASTOLE_SOURCE_DIR "/examples/phantom-a-points.study.toml";
  const std::vector<std::string> coarse = {"diastole",     "fit",    study,          "--mesh", "4,2,1",
                                           "--checkpoint", "k.json", "--iterations", "1"};
  (void)flow::run(place, coarse);
  const flow::Ended ended =
      flow::run(place, {"diastole", "fit", study, "--mesh", "3,2,1", "--checkpoint", "k.json", "--resume"});
  EXPECT_EQ(ended.exit_code, 2) << ended.err;
  EXPECT_THAT(ended.err, testing::AllOf(testing::HasSubstr("another fit"), testing::HasSubstr("4x2x1")));
  // A study of the same name that is not the same.
  std::string other = read_whole_file(study);
  other.replace(other.find("start = 6.0"), 11, "start = 7.0");
  for (size_t at = other.find("\"phantom"); at != std::string::npos; at = other.find("\"phantom", at + 20))
    other.replace(at, 1, std::string("\"") + DIASTOLE_SOURCE_DIR + "/examples/");
  write_whole_file(place / "phantom-a-points.study.toml", other);
  const flow::Ended elsewhere = flow::run(place, {"diastole", "fit", "phantom-a-points.study.toml", "--mesh",
                                                  "4,2,1", "--checkpoint", "k.json", "--resume"});
  EXPECT_EQ(elsewhere.exit_code, 2) << elsewhere.err;
  EXPECT_THAT(elsewhere.err, testing::HasSubstr("have changed since"));
  const flow::Ended same =
      flow::run(place, {"diastole", "fit", study, "--checkpoint", "k.json", "-o", "k.json"});
  EXPECT_EQ(same.exit_code, 2) << same.err;
  EXPECT_THAT(same.err, testing::HasSubstr("a file of its own"));
}

}  // namespace
}  // namespace diastole
