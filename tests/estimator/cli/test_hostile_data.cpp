// What `diastole fit` tells of data that are not what they say, and what it makes of them.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <random>

#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/cli/thinned_phantom.hpp"

namespace diastole {
namespace {

using test::ThinnedPhantom;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

class HostileData : public testing::Test {
 protected:
  /// The fit's JSON, on a mesh that is quick.
  nlohmann::json fit(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"fit", phantom_.study(), "--mesh", "4,2,1", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    testing::internal::CaptureStderr();
    const test::Outcome outcome = test::run_command(arguments);
    stderr_text_ = testing::internal::GetCapturedStderr();
    code_ = outcome.code;
    return nlohmann::json::parse(outcome.output);
  }

  static double stiffness_kPa(const nlohmann::json& fit) {
    return fit.at("parameters").at("C1_kPa").at("value").get<double>();
  }

  static std::vector<std::string> ids(const nlohmann::json& fit) {
    std::vector<std::string> ids;
    for (const auto& finding : fit.at("findings"))
      ids.push_back(finding.at("id"));
    return ids;
  }

  /// The tag points of loaded frames.
  template <class Change>
  void each_loaded_tag(Change change) {
    for (std::vector<double>& row : phantom_.tags.rows) {
      if (row[ThinnedPhantom::frame] > 0) change(row);
    }
  }

  ThinnedPhantom phantom_;
  std::string stderr_text_;
  ExitCode code_{};
};

TEST_F(HostileData, SoundDataAreFittedWithoutAWord) {
  const auto sound = fit();
  EXPECT_EQ(code_, ExitCode::done);
  EXPECT_THAT(ids(sound), IsEmpty()) << stderr_text_;
  EXPECT_THAT(stderr_text_, HasSubstr("Examining the data"));
}

TEST_F(HostileData, FivePerCentOfWildPointsAreToldAndHardlyCount) {
  const double sound_kPa = stiffness_kPa(fit({"--unexamined"}));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> outwards_mm(4.0, 20.0);
  size_t count = 0;
  each_loaded_tag([&](std::vector<double>& row) {
    if (++count % 20 != 0) return;
    const double radius_mm = std::hypot(row[ThinnedPhantom::place], row[ThinnedPhantom::place + 1]);
    const double factor = 1.0 + outwards_mm(random) / radius_mm;
    row[ThinnedPhantom::place] *= factor;
    row[ThinnedPhantom::place + 1] *= factor;
  });
  const auto spoilt = fit();
  ASSERT_EQ(code_, ExitCode::done) << stderr_text_;
  EXPECT_THAT(ids(spoilt), Contains("wild-points"));
  EXPECT_THAT(stderr_text_, HasSubstr("warning: "));
  EXPECT_NEAR(stiffness_kPa(spoilt), sound_kPa,
              0.03 * sound_kPa);  // one standard error of so few points is 2 %
  EXPECT_GT(spoilt.at("robust").at("wild").get<int>(), 20);
}

TEST_F(HostileData, FramesWithoutPointsAndPointsOutsideTheWallAreTold) {
  const double sound_kPa = stiffness_kPa(fit({"--unexamined"}));
  std::erase_if(phantom_.tags.rows, [](const auto& row) { return row[0] == 2 || row[0] == 4; });
  size_t count = 0;
  for (std::vector<double>& row : phantom_.tags.rows) {
    if (++count % 12 != 0) continue;
    row[ThinnedPhantom::place] *= 0.1;  // into the cavity, on a plane of its own
    row[ThinnedPhantom::place + 1] *= 0.1;
    row[ThinnedPhantom::plane] = 0;
    for (size_t k = 0; k < 3; ++k)
      row[ThinnedPhantom::plane] += row[ThinnedPhantom::normal + k] * row[ThinnedPhantom::place + k];
  }
  const auto spoilt = fit();
  EXPECT_EQ(code_, ExitCode::done);
  EXPECT_THAT(ids(spoilt), Contains("missing-frames"));
  EXPECT_THAT(ids(spoilt), Contains("outside-wall"));
  EXPECT_GT(spoilt.at("excluded").at(0).at("points").get<int>(), 20);
  EXPECT_NEAR(stiffness_kPa(spoilt), sound_kPa, 0.03 * sound_kPa);
}

TEST_F(HostileData, RowsThatAreThereTwiceCountOnce) {
  const auto sound = fit();
  const std::vector<std::vector<double>> rows = phantom_.tags.rows;
  phantom_.tags.rows.insert(phantom_.tags.rows.end(), rows.begin(), rows.end());
  const auto spoilt = fit();
  EXPECT_EQ(code_, ExitCode::done);
  EXPECT_THAT(ids(spoilt), testing::ElementsAre("duplicate-rows"));
  EXPECT_EQ(spoilt.at("parameters").at("C1_kPa"), sound.at("parameters").at("C1_kPa"));
  EXPECT_THAT(spoilt.at("excluded").dump(), HasSubstr("repeat another"));
}

TEST_F(HostileData, AnEstimateOnItsBoundIsNone) {
  std::string text = read_whole_file(phantom_.study());
  text.replace(text.find("[1.0, 15.0]"), 11, "[1.0, 7.0]");
  std::ofstream(phantom_.file("bounded.study.toml")) << text;
  testing::internal::CaptureStderr();
  const test::Outcome outcome = test::run_command(
      {"fit", phantom_.file("bounded.study.toml"), "--mesh", "4,2,1", "--unexamined", "--json"});
  (void)testing::internal::GetCapturedStderr();
  EXPECT_EQ(outcome.code, ExitCode::negative);
  const auto C1 = nlohmann::json::parse(outcome.output).at("parameters").at("C1_kPa");
  EXPECT_EQ(C1.at("at_bound"), "upper");
}

TEST_F(HostileData, CentimetresAreRefusedBeforeTheFit) {
  for (std::vector<double>& row : phantom_.tags.rows) {
    for (size_t k = 0; k < 3; ++k)
      row[ThinnedPhantom::place + k] /= 10.0;
    row[ThinnedPhantom::plane] /= 10.0;
  }
  const auto spoilt = fit({"-o", phantom_.file("gel.fit.json")});
  EXPECT_EQ(code_, ExitCode::negative);
  EXPECT_THAT(ids(spoilt), Contains("length-unit"));
  EXPECT_THAT(stderr_text_, testing::AllOf(HasSubstr("centimetres"), HasSubstr("Multiply"),
                                           HasSubstr("--unexamined"), testing::Not(HasSubstr("iteration"))));
  EXPECT_TRUE(spoilt.at("parameters").empty());
  EXPECT_FALSE(std::filesystem::exists(phantom_.file("gel.fit.json")));
}

TEST_F(HostileData, MillimetresOfMercuryAreRefusedBeforeTheFit) {
  for (std::vector<double>& row : phantom_.frames.rows)
    row[ThinnedPhantom::pressure] *= 7.50062;
  const auto spoilt = fit();
  EXPECT_EQ(code_, ExitCode::negative);
  EXPECT_THAT(ids(spoilt), Contains("pressure-unit"));
  EXPECT_THAT(stderr_text_, HasSubstr("mmHg"));
}

TEST_F(HostileData, AFrameThatWasNotLoadedIsToldAndRefusedWhereItMoved) {
  phantom_.frames.rows[5][ThinnedPhantom::pressure] = 0.0;
  const auto spoilt = fit();
  EXPECT_EQ(code_, ExitCode::negative);
  EXPECT_THAT(ids(spoilt), Contains("unloaded-frames"));
  EXPECT_THAT(ids(spoilt), Contains("motion-without-load"));
}

TEST_F(HostileData, AnOffsetOfThePressuresIsToldAndFoundByTheFit) {
  const double sound_kPa = stiffness_kPa(fit({"--unexamined"}));
  constexpr double offset_kPa = 1.6;
  for (size_t i = 1; i < phantom_.frames.rows.size(); ++i)
    phantom_.frames.rows[i][ThinnedPhantom::pressure] += offset_kPa;
  const auto spoilt = fit();
  EXPECT_EQ(code_, ExitCode::negative);  // on its bound
  EXPECT_EQ(spoilt.at("parameters").at("C1_kPa").at("at_bound"), "upper");
  EXPECT_THAT(ids(spoilt), Contains("pressure-offset"));
  EXPECT_THAT(stderr_text_, HasSubstr("`diastole fit --pressure-offset "));
  EXPECT_GT(stiffness_kPa(spoilt), 1.15 * sound_kPa);
  const auto sought = fit({"--pressure-offset", "2", "--unexamined"});
  EXPECT_NEAR(sought.at("pressure_offset_kPa").at("value").get<double>(), offset_kPa, 0.35);
  const auto& C1 = sought.at("parameters").at("C1_kPa");
  EXPECT_NEAR(C1.at("value").get<double>(), sound_kPa, 2.5 * C1.at("se").get<double>());
}

// At 0.2 kPa the gel bursts (its pressure has a maximum) long before the first frame's load.
TEST_F(HostileData, AStartFarTooSoftIsStiffenedOrToldWithARemedy) {
  const auto with_bounds = [&](const std::string& bounds) {
    std::string text = read_whole_file(phantom_.study());
    text.replace(text.find("[1.0, 15.0]"), 11, bounds);
    text.replace(text.find("start = 6.0"), 11, "start = 0.2");
    std::ofstream(phantom_.file("soft.study.toml")) << text;
    testing::internal::CaptureStderr();
    const test::Outcome outcome = test::run_command(
        {"fit", phantom_.file("soft.study.toml"), "--mesh", "4,2,1", "--json", "--unexamined"});
    stderr_text_ = testing::internal::GetCapturedStderr();
    code_ = outcome.code;
    return nlohmann::json::parse(outcome.output);
  };
  const auto found = with_bounds("[0.05, 15.0]");
  EXPECT_EQ(code_, ExitCode::done);
  EXPECT_NEAR(stiffness_kPa(found), stiffness_kPa(fit({"--unexamined"})), 0.01);
  EXPECT_THAT(found.at("remarks").dump(), HasSubstr("the search began at C1_kPa = "));
  const auto lost = with_bounds("[0.05, 0.5]");
  EXPECT_EQ(code_, ExitCode::negative);
  EXPECT_THAT(
      lost.at("reason").get<std::string>(),
      testing::AllOf(HasSubstr("no equilibrium"), HasSubstr("C1_kPa = 0.5"), HasSubstr("widen `bounds`")));
}

}  // namespace
}  // namespace diastole
