#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

// A thin rubber dome on a clamped ring.
constexpr const char* dome = R"(format = "diastole-study"
version = 1
[specimen]
kind = "ellipsoid"
inner_axes_mm = [20.0, 20.0]
outer_axes_mm = [22.0, 22.0]
base_z_mm = 0.0
fibre_endo_deg = 0.0
fibre_epi_deg = 0.0
mesh = [6, 3, 1]
ends = "fixed"
[law]
name = "neo-hookean"
[law.parameters.C1_kPa]
start = 6.5
bounds = [1.0, 15.0]
[data]
)";

class PvCommand : public testing::Test {
 protected:
  test::Outcome run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"pv", study_.string()});
    testing::internal::CaptureStderr();
    struct CapturedStderr {
      std::string& text;
      ~CapturedStderr() { text = testing::internal::GetCapturedStderr(); }
    } const captured{progress_};
    return test::run_command(std::move(arguments));
  }

  std::string refusal(const std::vector<std::string>& arguments) {
    return test::message_of([&] { (void)run(arguments); });
  }

  static std::string text_of(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }

  test::ScratchFolder folder_;
  std::filesystem::path study_ = folder_.write("dome.study.toml", dome);
  std::string progress_;
};

TEST_F(PvCommand, FollowsTheCurveOverTheLimitPoint) {
  const std::filesystem::path page = folder_.path() / "curve.html";
  const std::filesystem::path table = folder_.path() / "curve.csv";
  const test::Outcome outcome =
      run({"--volume-change-mL", "40", "--steps", "8", "-o", page.string(), "-o", table.string(), "--json"});
  EXPECT_EQ(outcome.code, ExitCode::done);
  const nlohmann::json json = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(json["reason"], "converged");
  ASSERT_EQ(json["points"].size(), 9U);
  ASSERT_EQ(json["limit_points"].size(), 1U);
  const double limit_kPa = json["limit_points"][0]["pressure_kPa"];
  EXPECT_GT(limit_kPa, json["points"][8]["pressure_kPa"].get<double>());
  EXPECT_TRUE(json["points"][1]["stable_at_pressure"].get<bool>());
  EXPECT_FALSE(json["points"][8]["stable_at_pressure"].get<bool>());
  EXPECT_TRUE(json["points"][8]["stable_at_volume"].get<bool>());
  EXPECT_NEAR(json["end"]["cavity_volume_change_mL"].get<double>(), 40.0, 1e-9);
  EXPECT_NEAR(json["work_mJ"].get<double>(), json["end"]["stored_energy_mJ"].get<double>(),
              1e-2 * json["work_mJ"].get<double>());
  EXPECT_THAT(progress_, testing::HasSubstr("pv: 40 mL"));

  const std::string csv = text_of(table);
  EXPECT_THAT(csv, testing::StartsWith("volume_change_mL,pressure_kPa,"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 10);
  EXPECT_THAT(text_of(page), testing::HasSubstr("limit point"));
}

TEST_F(PvCommand, TellsAPersonAndOverwritesOnlyItsOwn) {
  const std::filesystem::path table = folder_.path() / "curve.csv";
  const std::vector<std::string> arguments{"--volume-change-mL", "2", "--steps", "2", "-o", table.string()};
  EXPECT_THAT(run(arguments).output, testing::HasSubstr("The curve is in"));
  EXPECT_EQ(run(arguments).code, ExitCode::done);
  std::ofstream(table) << "something else\n";
  EXPECT_THAT(refusal(arguments), testing::HasSubstr("curve.csv"));
  EXPECT_EQ(text_of(table), "something else\n");
}

TEST_F(PvCommand, ACurveThatEndsEarlyIsANegativeAnswer) {
  const test::Outcome outcome = run({"--volume-change-mL", "-17", "--steps", "2", "--json"});
  EXPECT_EQ(outcome.code, ExitCode::negative);
  EXPECT_NE(nlohmann::json::parse(outcome.output)["reason"], "converged");
}

TEST_F(PvCommand, RefusesWhatItCannotDo) {
  EXPECT_THAT(refusal({"--volume-change-mL", "0"}), testing::HasSubstr("no volume to go to"));
  EXPECT_THAT(refusal({"--volume-change-mL", "5", "-o", "curve.png"}), testing::HasSubstr(".html"));
}

}  // namespace
}  // namespace diastole
