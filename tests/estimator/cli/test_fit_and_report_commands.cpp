#include <gmock/gmock.h>

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "estimator/io/whole_file.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

using test::Outcome;

class FitAndReport : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) const { return test::run_command(arguments); }

  std::string file(const char* name) const { return (folder_.path() / name).string(); }

  // A coarse mesh: quick, and 1.3 % off.
  std::vector<std::string> quick_fit(std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"fit", DIASTOLE_SOURCE_DIR "/examples/phantom-a.study.toml",
                                          "--mesh", "4,2,1", "--unexamined"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  // The example with data of its own, so that a mistake destroys a copy.
  std::string small_study() const {
    const std::string examples = DIASTOLE_SOURCE_DIR "/examples/";
    std::string text = read_whole_file(examples + "phantom-a.study.toml");
    for (const char* kind : {"tags", "frames"}) {
      const std::string name = fmt::format("phantom-a.{}.csv", kind);
      const std::string copy = fmt::format("gel.{}.csv", kind);
      std::filesystem::copy_file(examples + name, file(copy.c_str()),
                                 std::filesystem::copy_options::overwrite_existing);
      text.replace(text.find(name), name.size(), copy);
    }
    return folder_.write("study.toml", text).string();
  }

  test::ScratchFolder folder_;
};

TEST_F(FitAndReport, JsonHoldsWhatTheContractSays) {
  const Outcome outcome = run(quick_fit({"--json"}));
  EXPECT_EQ(outcome.code, ExitCode::done);
  const auto json = nlohmann::json::parse(outcome.output);
  const auto& C1 = json.at("parameters").at("C1_kPa");
  EXPECT_NEAR(C1.at("value").get<double>(), 8.6, 0.2);
  EXPECT_GT(C1.at("se").get<double>(), 0.05);
  EXPECT_LT(C1.at("ci95").at(0).get<double>(), C1.at("value").get<double>());
  EXPECT_GT(C1.at("ci95").at(1).get<double>(), C1.at("value").get<double>());
  EXPECT_EQ(json.at("correlation").at("matrix").size(), 6U);  // C1 and five pressures
  EXPECT_NEAR(json.at("rms_mm").get<double>(), 0.8, 0.02);
  EXPECT_GT(json.at("iterations").get<int>(), 0);
  EXPECT_THAT(json.at("reason").get<std::string>(), HasSubstr("Converged"));
  EXPECT_GT(json.at("seconds").get<double>(), 0.0);
}

TEST_F(FitAndReport, AnEnergyFileThatIsNoLoopIsRefusedBeforeTheExamination) {
  const std::string loop = folder_
                               .write("loop.csv",
                                      "phase_s,volume_mL,volume_sigma_mL,pressure_kPa,pressure_sigma_kPa\n"
                                      "0.1,10,0.1,0.5,0.01\n0.2,11,0.1,1.0,0.01\n")
                               .string();
  const std::string gel = DIASTOLE_SOURCE_DIR "/examples/phantom-a.study.toml";
  testing::internal::CaptureStderr();
  const std::string message = message_of([&] {
    (void)run({"fit", gel, "--mesh", "4,2,1", "--energy", loop});
  });
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::Not(HasSubstr("Examining")));
  EXPECT_THAT(message, HasSubstr("2 points are no loop"));
}

TEST_F(FitAndReport, AFitIsKeptAndReported) {
  const Outcome fit = run(quick_fit({"--set", "C1_kPa=9", "-o", file("fit.json")}));
  EXPECT_EQ(fit.code, ExitCode::done);
  EXPECT_THAT(fit.output, testing::StartsWith("C1 = 8."));
  EXPECT_THAT(fit.output, HasSubstr("95 % interval"));
  const std::vector<std::string> request = {
      "report",          DIASTOLE_SOURCE_DIR "/examples/recorded-baseline.run.h5",
      file("fit.json"),  "-o",
      file("page.html"), "--json"};
  const Outcome report = run(request);
  EXPECT_EQ(report.code, ExitCode::done);
  const auto json = nlohmann::json::parse(report.output);
  EXPECT_EQ(json.at("bytes").get<size_t>(), std::filesystem::file_size(file("page.html")));
}

TEST_F(FitAndReport, AFitThatDoesNotConvergeIsANegativeAnswer) {
  EXPECT_EQ(run(quick_fit({"--iterations", "1", "--json"})).code, ExitCode::negative);
}

TEST_F(FitAndReport, AnOutputThatCannotBeWrittenIsRefusedBeforeTheFit) {
  testing::internal::CaptureStderr();
  EXPECT_THROW((void)run(quick_fit({"-o", file("no/such/folder/fit.json")})), InputError);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::Not(HasSubstr("iteration")));
}

// A link is another name of the same file.
TEST_F(FitAndReport, AFitDoesNotReplaceWhatItReads) {
  for (const char* name : {"study.toml", "gel.tags.csv", "gel.frames.csv"}) {
    const std::string study = small_study();
    std::filesystem::remove(file("link"));
    std::filesystem::create_hard_link(file(name), file("link"));
    for (const std::string& output : {file(name), file("link")}) {
      const std::string before = read_whole_file(output);
      EXPECT_THAT(message_of([&] {
                    (void)run({"fit", study, "--force", "-o", output});
                  }),
                  AllOf(HasSubstr(output), HasSubstr("is read by this command"), HasSubstr("another name")));
      EXPECT_EQ(read_whole_file(output), before);
    }
  }
}

TEST_F(FitAndReport, AReportDoesNotReplaceWhatItReads) {
  const std::string run_file = file("gel.run.h5");
  std::filesystem::copy_file(DIASTOLE_SOURCE_DIR "/examples/recorded-baseline.run.h5", run_file);
  const std::string before = read_whole_file(run_file);
  EXPECT_THAT(message_of([&] {
                (void)run({"report", run_file, "--force", "-o", run_file});
              }),
              AllOf(HasSubstr(run_file), HasSubstr("is read by this command")));
  EXPECT_EQ(read_whole_file(run_file), before);
}

TEST_F(FitAndReport, OnlyAnEarlierResultIsReplacedWithoutForce) {
  const std::string run_file = DIASTOLE_SOURCE_DIR "/examples/recorded-baseline.run.h5";
  const std::string notes = folder_.write("notes.html", "<!DOCTYPE html>\nmine").string();
  const std::vector<std::string> report = {"report", run_file, "-o", notes};
  EXPECT_THAT(message_of([&] { (void)run(report); }),
              AllOf(HasSubstr(notes), HasSubstr("exists already"), HasSubstr("--force")));
  EXPECT_EQ(read_whole_file(notes), "<!DOCTYPE html>\nmine");
  EXPECT_EQ(run({"report", run_file, "--force", "-o", notes}).code, ExitCode::done);
  EXPECT_EQ(run(report).code, ExitCode::done);

  const std::string fit = folder_.write("fit.json", "{\"mine\": 1}").string();
  EXPECT_THAT(message_of([&] { (void)run(quick_fit({"-o", fit})); }), HasSubstr("--force"));
  EXPECT_EQ(run(quick_fit({"--force", "-o", fit})).code, ExitCode::done);
  EXPECT_EQ(run(quick_fit({"-o", fit})).code, ExitCode::done);
}

TEST_F(FitAndReport, ACheckpointHoldsWhatWasReachedAndIsTakenUp) {
  const std::string checkpoint = file("gel.checkpoint.json");
  const Outcome cut = run(quick_fit({"--json", "--checkpoint", checkpoint, "--iterations", "1"}));
  EXPECT_EQ(cut.code, ExitCode::negative);
  const auto reached = nlohmann::json::parse(read_whole_file(checkpoint));
  EXPECT_THAT(reached.at("reason").get<std::string>(), HasSubstr("Checkpoint after iteration 1"));
  EXPECT_FALSE(reached.at("converged").get<bool>());
  const auto whole = nlohmann::json::parse(run(quick_fit({"--json"})).output);
  const Outcome resumed = run(quick_fit({"--json", "--checkpoint", checkpoint, "--resume"}));
  EXPECT_EQ(resumed.code, ExitCode::done);
  const auto json = nlohmann::json::parse(resumed.output);
  const double expected = whole.at("parameters").at("C1_kPa").at("value");
  EXPECT_NEAR(json.at("parameters").at("C1_kPa").at("value").get<double>(), expected, 1e-4);
  EXPECT_LT(json.at("iterations").get<int>(), whole.at("iterations").get<int>());
  EXPECT_EQ(run({"report", checkpoint, "-o", file("checkpoint.html")}).code, ExitCode::done);
}

TEST_F(FitAndReport, AResultOfOtherParametersIsNoStart) {
  const std::string result = file("gel.fit.json");
  ASSERT_EQ(run(quick_fit({"-o", result})).code, ExitCode::done);
  std::string text = read_whole_file(result);
  for (size_t at = text.find("C1_kPa"); at != std::string::npos; at = text.find("C1_kPa"))
    text.replace(at, 6, "c9_kPa");
  const std::string other = folder_.write("other.fit.json", text).string();
  EXPECT_THAT(message_of([&] {
                run(quick_fit({"--start", other}));
              }),
              AllOf(HasSubstr("C1_kPa"), HasSubstr("same law and mesh")));
  EXPECT_THAT(message_of([&] { run(quick_fit({"--resume"})); }), HasSubstr("--checkpoint"));
}

TEST_F(FitAndReport, ProfileAndPosteriorComeIntoResultAndReport) {
  const std::string result = file("gel.fit.json");
  ASSERT_EQ(
      run(quick_fit({"--profile", "--posterior", "40", "--pressure-offset", "0.05", "-o", result})).code,
      ExitCode::done);
  const auto json = nlohmann::json::parse(read_whole_file(result));
  const auto& C1 = json.at("parameters").at("C1_kPa");
  EXPECT_LT(C1.at("profile").at("ci95").at(0).get<double>(), C1.at("value").get<double>());
  EXPECT_GT(C1.at("posterior").at("r_hat").get<double>(), 0.9);
  EXPECT_GE(json.at("posterior").at("equilibria").get<int>(), 40);
  EXPECT_GT(json.at("pressure_offset_kPa").at("se").get<double>(), 0.0);
  ASSERT_EQ(run({"report", result, "-o", file("gel.html")}).code, ExitCode::done);
  EXPECT_THAT(read_whole_file(file("gel.html")), AllOf(HasSubstr("R-hat"), HasSubstr("profile")));
}

TEST_F(FitAndReport, ADeviceIsNotReplacedByAFile) {
  const std::string run_file = DIASTOLE_SOURCE_DIR "/examples/recorded-baseline.run.h5";
  std::filesystem::create_symlink("/dev/null", file("sink"));
  EXPECT_THAT(message_of([&] {
                (void)run({"report", run_file, "-o", file("sink")});
              }),
              HasSubstr("cannot be written"));
  EXPECT_TRUE(std::filesystem::is_symlink(file("sink")));
}

TEST_F(FitAndReport, NothingIsLeftWhenThePageCannotBeMade) {
  const std::vector<std::string> request = {"report", folder_.write("junk.txt", "junk").string(), "-o",
                                            file("page.html")};
  EXPECT_THROW((void)run(request), InputError);
  EXPECT_FALSE(std::filesystem::exists(file("page.html")));
}

}  // namespace
}  // namespace diastole
