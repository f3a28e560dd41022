#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/cli/thinned_phantom.hpp"

namespace diastole {
namespace {

using test::Outcome;
using test::ThinnedPhantom;
using testing::AllOf;
using testing::HasSubstr;

class ReconstructCommand : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"reconstruct", phantom_.study(), "--mesh", "4,2,1", "--no-stiffness"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    testing::internal::CaptureStderr();
    struct CapturedStderr {
      std::string& text;
      ~CapturedStderr() { text = testing::internal::GetCapturedStderr(); }
    } const captured{stderr_text_};
    return test::run_command(arguments);
  }

  std::string refusal(const std::vector<std::string>& arguments) {
    return test::message_of([&] { (void)run(arguments); });
  }

  ThinnedPhantom phantom_;
  std::string stderr_text_;
};

TEST_F(ReconstructCommand, TellsAndWritesAllThatItIsAskedFor) {
  const std::string points = phantom_.file("gel.points.csv"), grid = phantom_.file("gel.vtkhdf"),
                    record = phantom_.file("gel.json");
  const Outcome outcome = run({"-o", points, "-o", grid, "-o", record});
  EXPECT_EQ(outcome.code, ExitCode::done);
  EXPECT_THAT(outcome.output,
              AllOf(HasSubstr("pressure (kPa)"), HasSubstr("Least is known of element"),
                    HasSubstr("Nothing is wrong with the data."), HasSubstr("Written: " + grid)));
  EXPECT_GT(std::filesystem::file_size(grid), 0U);
  const auto json = nlohmann::json::parse(read_whole_file(record));
  ASSERT_EQ(json.at("frames").size(), 5U);
  EXPECT_NEAR(json.at("frames").at(4).at("largest_displacement_mm").get<double>(), 2.6, 0.5);
  EXPECT_EQ(test::run_command({"report", record, "-o", phantom_.file("gel.html")}).code, ExitCode::done);

  // The paper's way: the points are data for a fit.
  std::string study = read_whole_file(phantom_.study());
  const std::string tags = "tags = \"phantom-a.tags.csv\"";
  study.replace(study.find(tags), tags.size(), "points = \"gel.points.csv\"");
  std::ofstream(phantom_.file("points.study.toml")) << study;
  const Outcome fit = test::run_command(
      {"fit", phantom_.file("points.study.toml"), "--mesh", "4,2,1", "--unexamined", "--json"});
  EXPECT_EQ(fit.code, ExitCode::done);
  EXPECT_NEAR(nlohmann::json::parse(fit.output).at("parameters").at("C1_kPa").at("value").get<double>(), 8.7,
              1.3);
}

TEST_F(ReconstructCommand, JsonHoldsTheRecordWithoutItsDrawings) {
  const Outcome outcome = run({"--json", "--lambda", "1e4", "--points", "10"});
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(json.at("format"), "diastole-reconstruction");
  EXPECT_EQ(json.at("points_a_frame"), 10);
  EXPECT_EQ(json.at("frames").at(0).at("lambda"), 1e4);
  EXPECT_TRUE(json.at("sections").empty());
}

TEST_F(ReconstructCommand, DataThatCannotBeAreANegativeAnswerAndLeaveNoFile) {
  for (std::vector<double>& row : phantom_.tags.rows)
    row[ThinnedPhantom::plane] /= 10.0;
  const std::string record = phantom_.file("gel.json");
  const Outcome outcome = run({"-o", record});
  EXPECT_EQ(outcome.code, ExitCode::negative);
  EXPECT_THAT(outcome.output, AllOf(HasSubstr("error: "), HasSubstr("Nothing was reconstructed")));
  EXPECT_FALSE(std::filesystem::exists(record));
}

TEST_F(ReconstructCommand, RefusesWhatItCannotDo) {
  EXPECT_THAT(refusal({"-o", phantom_.file("gel.vtu")}), HasSubstr(".vtkhdf (for ParaView)"));
  EXPECT_THAT(refusal({"--smoothing", "0,0"}), HasSubstr("at least one weight above 0"));
  EXPECT_THAT(refusal({"-o", phantom_.file("phantom-a.tags.csv"), "--force"}),
              HasSubstr("is read by this command"));
  std::ofstream(phantom_.file("mine.csv")) << "mine";
  EXPECT_THAT(refusal({"-o", phantom_.file("mine.csv")}), AllOf(HasSubstr("mine.csv"), HasSubstr("--force")));
  EXPECT_THAT(test::message_of([&] {
                (void)test::run_command({"reconstruct", phantom_.file("absent.study.toml")});
              }),
              HasSubstr("absent.study.toml"));
}

}  // namespace
}  // namespace diastole
