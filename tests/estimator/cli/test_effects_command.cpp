#include <gmock/gmock.h>

#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

TEST(EffectsCommand, ShowsUnitsAndScalesAndRemarksOnUnknownIds) {
  const test::ScratchFolder folder;
  const std::string file = folder
                               .write("mine.effect.toml", R"toml(
format = "diastole-effect"
version = 1
id = "mine"
title = "mine"
port = "sensor"
[[parameter]]
name = "shift"
unit = "mmHg"
neutral = 0.0
bounds = [-1.0, 2.0]
meaning = "of all readings"
[[parameter]]
name = "tau"
unit = "s"
neutral = 2.0
bounds = [1.0, 10.0]
scale = "logarithmic"
[equations]
p_seen = "p + shift * exp(-t / tau)"
[text]
looks_alike = ["sensor-ofset", "sensor-gain"]
)toml")
                               .string();
  testing::internal::CaptureStderr();
  const test::Outcome outcome = test::run_command({"effects", file});
  const std::string remarks = testing::internal::GetCapturedStderr();
  EXPECT_THAT(outcome.output, HasSubstr("of all readings; neutral 0, from -1 to 2 mmHg\n"));
  EXPECT_THAT(outcome.output, HasSubstr(" neutral 2, from 1 to 10 s, searched by its logarithm\n"));
  EXPECT_THAT(remarks,
              HasSubstr("text.looks_alike: no built-in effect is called \"sensor-ofset\". Did you mean "
                        "\"sensor-offset\"?"));
  EXPECT_THAT(remarks, testing::Not(HasSubstr("sensor-gain")));
}

}  // namespace
}  // namespace diastole
