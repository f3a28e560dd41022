#include <gmock/gmock.h>

#include <csignal>

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

}  // namespace
}  // namespace diastole
