#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "estimator/io/whole_file.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

std::string bench(const std::string& name) {
  return std::string(DIASTOLE_SOURCE_DIR "/examples/bench-tests/") + name + ".csv";
}

test::Outcome law(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "law");
  return test::run_command(std::move(arguments));
}

/// The examples are a Mooney-Rivlin gel with 6 and 2 kPa; docs/law.md says so.
TEST(LawCommand, ChoosesTheLawOfTheExamples) {
  const test::Outcome outcome =
      law({bench("uniaxial"), bench("biaxial"), bench("torsion"), bench("tube"), "--law", "neo-hookean",
           "--law", "mooney-rivlin", "--law", "demiray", "--json"});
  EXPECT_EQ(outcome.code, ExitCode::done);
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(json.at("preferred"), "mooney-rivlin");
  EXPECT_EQ(json.at("tests").size(), 4U);
  const auto& best = json.at("laws").at(0);
  EXPECT_EQ(best.at("law"), "mooney-rivlin");
  EXPECT_EQ(best.at("left_out").size(), 4U);
  const auto& parameters = best.at("parameters");
  for (const auto& [name, truth_kPa] : {std::pair("C1_kPa", 6.0), std::pair("C2_kPa", 2.0)}) {
    const double se_kPa = parameters.at(name).at("se");
    EXPECT_NEAR(parameters.at(name).at("value").get<double>(), truth_kPa, 4 * se_kPa);
    EXPECT_LT(se_kPa, 0.03 * truth_kPa);
  }
  EXPECT_NEAR(best.at("error_percent").get<double>(), 1.0, 0.2);
}

TEST(LawCommand, SaysWhatIsNotDetermined) {
  const test::Outcome outcome =
      law({DIASTOLE_SOURCE_DIR "/examples/shear-test.csv", "--law", "mooney-rivlin"});
  EXPECT_EQ(outcome.code, ExitCode::negative);
  EXPECT_THAT(outcome.output, HasSubstr("not determined: C1_kPa"));
}

TEST(LawCommand, WritesItsPageAndReplacesNothingElse) {
  const test::ScratchFolder folder;
  const std::string page = (folder.path() / "law.html").string();
  EXPECT_EQ(law({bench("uniaxial"), "--law", "neo-hookean", "--law", "mooney-rivlin", "-o", page}).code,
            ExitCode::done);
  EXPECT_THAT(read_whole_file(page), testing::AllOf(HasSubstr("Parameters of mooney-rivlin"),
                                                    HasSubstr("Uniaxial test"), HasSubstr("<svg")));
  const std::string notes = folder.write("notes.html", "mine").string();
  EXPECT_THAT(test::message_of([&] { (void)law({bench("uniaxial"), "-o", notes}); }), HasSubstr("--force"));
}

TEST(LawCommand, NamesTheNearestLaw) {
  EXPECT_THAT(test::message_of([&] {
                (void)law({bench("uniaxial"), "--law", "mooney"});
              }),
              HasSubstr("Did you mean \"mooney-rivlin\"?"));
  EXPECT_THAT(test::message_of([&] {
                (void)law({bench("uniaxial"), "--law", "guccione"});
              }),
              HasSubstr("fibre_deg"));
}

}  // namespace
}  // namespace diastole
