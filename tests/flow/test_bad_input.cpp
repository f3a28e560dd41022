// Bad input to whole programs: the message says where, what and what to do; the exit code is 2 or 3; nothing
// is left.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <functional>
#include <ostream>
#include <set>
#include <sstream>

#include "tests/flow/programs.hpp"

namespace diastole::flow {
namespace {

using testing::HasSubstr;

struct BadInput {
  std::string name;
  std::function<std::vector<std::string>(const Workplace&)> arguments;  ///< may write files first
  int exit_code;
  std::vector<std::string> message;  ///< what it must contain: file, place, value, remedy
};

const std::filesystem::path source = DIASTOLE_SOURCE_DIR;

void PrintTo(const BadInput& input, std::ostream* out) { *out << input.name; }

std::string gel() { return source_text("examples/gel.experiment.toml"); }

std::vector<std::string> simulate(const Workplace& place, const std::string& experiment) {
  place.write("bad.toml", experiment);
  return {"diastole", "simulate", "bad.toml", "-o", "out.run.h5", "--pins", "pins.csv"};
}

std::vector<std::string> simulate_in(const Workplace& place, const std::string& rig) {
  place.write("bad.rig.toml", rig);
  auto arguments = simulate(place, gel());
  arguments.insert(arguments.end(), {"--config", "bad.rig.toml"});
  return arguments;
}

/// The recorded phantom, in a scan with other options.
std::vector<std::string> scan(const Workplace& place, const std::vector<std::string>& options) {
  place.write("gel.frames.csv", source_text("examples/phantom-a.frames.csv"));
  place.write("gel.study.toml",
              with(with(source_text("examples/phantom-a.study.toml"), "tags = \"phantom-a.tags.csv\"\n", ""),
                   "phantom-a.frames.csv", "gel.frames.csv"));
  std::vector<std::string> arguments = {"diastole", "scan", "gel.study.toml", "-o", "scan"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return arguments;
}

/// A table of frames with its third column, and the fourth, so many times as large.
std::string pressures_times(double factor, const std::string& frames) {
  std::istringstream lines(frames);
  std::string made, line;
  std::getline(lines, line);
  made = line + "\n";
  int frame = 0;
  double time_s = 0, pressure_kPa = 0, sigma_kPa = 0;
  while (std::getline(lines, line) &&
         std::sscanf(line.c_str(), "%d,%lf,%lf,%lf", &frame, &time_s, &pressure_kPa, &sigma_kPa) == 4)
    made += fmt::format("{},{},{},{}\n", frame, time_s, factor * pressure_kPa, factor * sigma_kPa);
  return made;
}

/// Copies of one recording.
std::string recording(const Workplace& place, const std::string& name) {
  std::filesystem::copy_file(source / "examples/recorded-baseline.run.h5", place / name);
  return name;
}

std::vector<std::string> own_effect(const Workplace& place, const std::string& term) {
  place.write("own.effect.toml",
              with(source_text("examples/effects/my-seal.effect.toml"), "abs(p_pump) / 10 [kPa]", term));
  return {"diastole", "effects", "own.effect.toml"};
}

std::vector<std::string> shape(const std::string& wanted, const std::vector<std::string>& options) {
  std::vector<std::string> arguments{
      "diastole", "shape", wanted, "--study", source / "examples/shape/gel.study.toml", "-o", "drive.csv"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return arguments;
}

std::vector<BadInput> table() {
  using Place = const Workplace&;
  return {
      {"TwoRunsOfOneBidsName",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "export", recording(place, "gel-1.run.h5"), recording(place, "gel_1.run.h5"),
                 "--bids",   "bids"};
       },
       2,
       {"gel_1.run.h5", "sub-01_task-gel1_physio", "gel-1.run.h5", "--task"}},
      {"ACrateInPlaceOfAFile",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "export", recording(place, "gel.run.h5"), "--ro-crate",
                 place.write("notes.txt", "warm")};
       },
       2,
       {"notes.txt", "is no folder"}},
      {"ALicenceThatIsNone",
       [](Place place) -> std::vector<std::string> {
         return {"diastole",  "export", recording(place, "gel.run.h5"), "--ro-crate", "crate",
                 "--license", "CC-BY-4"};
       },
       2,
       {"--license", "\"CC-BY-4\"", "https", "Did you mean \"CC-BY-4.0\"?"}},
      {"ANoteThatSteersTheTerminal",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "note", recording(place, "gel.run.h5"), "red \x1b[31m"};
       },
       2,
       {"gel.run.h5", "note", "control character 0x1b", "UTF-8"}},
      {"ANoteThatIsNotUtf8",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "note", recording(place, "gel.run.h5"), "warm\xE4"};
       },
       2,
       {"gel.run.h5", "note", "is not UTF-8 at byte 4"}},
      {"ARecordingForAnExperiment",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "run", recording(place, "gel.run.h5"), "-o", "out.run.h5"};
       },
       2,
       {"gel.run.h5", "is an HDF5 file"}},
      {"ARecordingForABenchTest",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "law", recording(place, "gel.run.h5")};
       },
       2,
       {"gel.run.h5", "is an HDF5 file", "CSV"}},
      {"APageInPlaceOfARecording",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "runs", ".", "-o", recording(place, "gel.run.h5"), "--force"};
       },
       2,
       {"gel.run.h5", "is a recording", "another name"}},
      {"AnOptionWhereItsValueWasForgotten",
       [](Place) -> std::vector<std::string> {
         return {"diastole", "runs", ".", "-o", "--json"};
       },
       2,
       {"--output", "has no value before --json", "--help"}},
      {"RunsSinceNoMonth",
       [](Place) -> std::vector<std::string> {
         return {"diastole", "runs", "since=2026-13"};
       },
       2,
       {"since=2026-13", "no date", "2026-11-23"}},
      {"OneRecordingTwice",
       [](Place place) -> std::vector<std::string> {
         recording(place, "a.run.h5");
         recording(place, "b.run.h5");
         place.write("twice.study.toml",
                     with(source_text("examples/shape/gel.study.toml"), R"("../paper-gap/paper-gap.run.h5")",
                          R"("a.run.h5", "b.run.h5")"));
         return {"diastole", "explain", "twice.study.toml", "-o", "found"};
       },
       2,
       {"twice.study.toml", "data.runs", "a.run.h5", "b.run.h5", "one recording", "once"}},
      {"ADocumentForAStudy",
       [](Place place) -> std::vector<std::string> {
         place.write("explanation.json", "{\"verdict\": \"none\"}\n");
         return {"diastole", "explain", "explanation.json", "-o", "found"};
       },
       2,
       {"explanation.json", "is JSON, but a TOML file is expected here", "NAME.study.toml"}},
      {"BenchTestsTwice",
       [](Place) -> std::vector<std::string> {
         const std::string data = source / "examples/bench-tests/uniaxial.csv";
         return {"diastole", "law", data, data};
       },
       2,
       {"uniaxial.csv", "is given twice"}},
      {"AnEffectWithoutALimitAtRest",
       [](Place place) { return own_effect(place, "log(p_pump / 10 [kPa])"); },
       2,
       {"own.effect.toml", "key equations.q_hose", "not a finite number", "p_pump = 0 kPa", "at rest"}},
      {"AnEffectWithADivisionByZero",
       [](Place place) { return own_effect(place, "abs(p_pump) / 0 [kPa]"); },
       2,
       {"own.effect.toml", "key equations.q_hose", "divides by zero"}},
      {"ADriveInMilliseconds",
       [](Place place) {
         return shape(place.write("ms.csv", "time_s,volume_mL\n0,0\n600,8\n900,3\n1200,0\n"), {});
       },
       2,
       {"ms.csv", "time_s", "1200 s", "600 s", "in seconds"}},
      {"AnEndlessDrive",
       [](Place) {
         return shape(source / "examples/shape/ventricle.csv", {"--cycles", "1000000000"});
       },
       2,
       {"--cycles", "1000"}},
      {"AShapesPageOverItsDrive",
       [](Place) {
         return shape(source / "examples/shape/ventricle.csv", {"--page", "./drive.csv"});
       },
       2,
       {"drive.csv", "is another output", "name of its own"}},
      {"AFlowsPageOverItsTable",
       [](Place) -> std::vector<std::string> {
         return {"diastole", "flow", ".", "-o", "a.flow.csv", "--page", "a.flow.csv"};
       },
       2,
       {"a.flow.csv", "is another output", "name of its own"}},
      {"ScanWithoutRoom",
       [](Place place) {
         return scan(place, {"--fov", "90"});
       },
       2,
       {"--fov", "90 mm", "100 mm across", "115 mm"}},
      {"ScanOfTagsTooDense",
       [](Place place) {
         return scan(place, {"--tag-spacing", "1"});
       },
       2,
       {"--tag-spacing", "1 mm", "three pixels", "--matrix"}},
      {"ScanOfNothing", [](Place place) { return scan(place, {"--no-tags"}); }, 2, {"--no-tags", "--cine"}},
      {"ScanOfFlowInPartOfACycle",
       [](Place place) {
         return scan(place, {"--flow", "--period", "30"});
       },
       2,
       {"--flow", "a cycle of 30 s", "--period"}},
      {"ScanOfNoTime",
       [](Place place) {
         return scan(place, {"--period", "1e-9"});
       },
       2,
       {"--period", "does not hold the phases", "from trigger to trigger"}},
      {"ExplainImagesWhosePressuresAreInMmHg",
       [](const Workplace& place) {
         place.write("gel.frames.csv", pressures_times(7.5, source_text("examples/phantom-a.frames.csv")));
         place.write("gel.tags.csv", source_text("examples/phantom-a.tags.csv"));
         place.write("gel.study.toml", with(with(source_text("examples/phantom-a.study.toml"),
                                                 "phantom-a.frames.csv", "gel.frames.csv"),
                                            "phantom-a.tags.csv", "gel.tags.csv"));
         return std::vector<std::string>{"diastole", "explain", "gel.study.toml", "-o", "found"};
       },
       1,
       {"error: ", "column pressure_kPa", "may be in mmHg", "--unexamined explains them nevertheless"}},
      {"FitOfImagesThatAreNowhere",
       [](Place place) {
         std::vector<std::string> arguments = scan(place, {});
         place.write("gel.study.toml", with(source_text("examples/tagged-gel/tagged-gel.study.toml"),
                                            "images = \"dicom\" ", "images = \"nowhere\" "));
         place.write("tagged-gel.frames.csv", source_text("examples/tagged-gel/tagged-gel.frames.csv"));
         return std::vector<std::string>{"diastole", "fit", "gel.study.toml"};
       },
       2,
       {"gel.study.toml", "[data] images", "nowhere", "is no folder", "images = \"dicom/\""}},
      {"ScanOfFibresThatAreNone",
       [](Place place) { return scan(place, {"--diffusion"}); },
       2,
       {"--diffusion", "no fibres"}},
      {"ScanBeyondTheModel",
       [](Place place) {
         return scan(place, {"--peak-kPa", "60", "--phases", "4"});
       },
       2,
       {"gel.study.toml", "pressure", "--set"}},
      {"ScanIntoAFolderInUse",
       [](Place place) {
         place.write("notes.txt", "precious");
         auto arguments = scan(place, {});
         arguments[4] = ".";
         return arguments;
       },
       2,
       {"-o", "not empty", "new folder"}},
      {"MissingFile",
       [](Place) -> std::vector<std::string> {
         return {"diastole", "simulate", "no.toml", "-o", "out.run.h5"};
       },
       2,
       {"no.toml", "cannot be opened", "Check the path"}},
      {"WaveformFileMissing",
       [](Place place) { return simulate(place, source_text("examples/heart.experiment.toml")); },
       2,
       {"heart.csv", "cannot be opened", "Check the path"}},
      {"WaveformNotClosed",
       [](Place place) {
         place.write("heart.csv", "phase,fraction\n0,0\n0.4,1\n1,0.2\n");
         return simulate(place, source_text("examples/heart.experiment.toml"));
       },
       2,
       {"heart.csv", "line 4", "0.2", "closes the cycle"}},
      {"WaveformTooHard",
       [](Place place) {
         place.write("heart.csv", "phase,fraction\n0,0\n0.3,0.01\n0.4,1\n0.7,1\n1,0\n");
         return simulate(place, source_text("examples/heart.experiment.toml"));
       },
       2,
       {"bad.toml", "segment[0]", "limit", "asked", "acceleration", "allowed", "Reduce stroke_mL"}},
      {"NotToml",
       [](Place place) { return simulate(place, "format = diastole"); },
       2,
       {"bad.toml", "line 1", "not TOML", "Correct the syntax"}},
      {"WrongFormat",
       [](Place place) { return simulate(place, with(gel(), "diastole-experiment", "diastole-study")); },
       2,
       {"bad.toml", "line 2", "format", "diastole-study", "Give the right kind of file"}},
      {"NewerVersion",
       [](Place place) { return simulate(place, with(gel(), "version = 1", "version = 9")); },
       2,
       {"bad.toml", "version", "9", "Update Diastole"}},
      {"UnknownKey",
       [](Place place) { return simulate(place, with(gel(), "stroke_mL", "stroke_ml")); },
       2,
       {"bad.toml", "segment[0].stroke_mL", "\"stroke_ml\" on line 10", "did you mean stroke_mL?"}},
      {"NotANumber",
       [](Place place) { return simulate(place, with(gel(), "stroke_mL = 40.0", "stroke_mL = nan")); },
       2,
       {"bad.toml", "line", "stroke_mL", "nan"}},
      {"NegativePeriod",
       [](Place place) { return simulate(place, with(gel(), "period_s = 1.2", "period_s = -1.2")); },
       2,
       {"bad.toml", "period_s", "-1.2", "at least"}},
      {"UnknownWaveform",
       [](Place place) { return simulate(place, with(gel(), "\"parabolic\"", "\"parabolik\"")); },
       2,
       {"bad.toml", "waveform", "parabolik", "parabolic"}},
      {"TooFastForTheRig",
       [](Place place) { return simulate(place, with(gel(), "period_s = 1.2", "period_s = 0.2")); },
       2,
       {"bad.toml", "segment", "acceleration", "16000", "1700"}},
      {"OffsetOutOfRange",
       [](Place place) { return simulate(place, with(gel(), "offset_mL = 0.0", "offset_mL = 8000.0")); },
       2,
       {"bad.toml", "line 13", "offset_mL", "8000", "at most"}},
      {"BeyondTheTravel",
       [](Place place) {
         return simulate_in(place, with(source_text("examples/rig.toml"), "microsteps = 8\n",
                                        "microsteps = 8\n[controller.limits]\ntravel_mL = 30.0\n"));
       },
       2,
       {"bad.toml", "segment", "travel", "40", "30"}},
      {"ExistingOutput",
       [](Place place) {
         place.write("out.run.h5", "precious");
         return simulate(place, gel());
       },
       2,
       {"out.run.h5", "exists already", "--force"}},
      {"ExistingPins",
       [](Place place) {
         place.write("pins.csv", "precious");
         return simulate(place, gel());
       },
       2,
       {"pins.csv", "exists already", "--force"}},
      {"APathThatIsNone",
       [](Place) -> std::vector<std::string> {
         return {"diastole", "solve", std::string(300, 'a') + ".study.toml", "--pressure-kPa", "1"};
       },
       2,
       {"aaa", "cannot be opened"}},
      {"NoSuchDirectory",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "simulate", place.write("gel.toml", gel()), "-o", "nowhere/out.run.h5"};
       },
       2,
       {"nowhere", "-o"}},
      {"NoDirectoryForThePins",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "simulate",        place.write("gel.toml", gel()), "-o", "out.run.h5",
                 "--pins",   "nowhere/pins.csv"};
       },
       2,
       {"nowhere", "--pins"}},
      {"OneNameForTwoOutputs",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "simulate",    place.write("gel.toml", gel()), "-o", "out.run.h5",
                 "--pins",   "./out.run.h5"};
       },
       2,
       {"out.run.h5", "both", "-o", "--pins"}},
      {"TheExperimentAsOutput",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "simulate", place.write("gel.toml", gel()), "-o", "gel.toml", "--force"};
       },
       2,
       {"gel.toml", "is read by this command", "another name"}},
      {"UnknownOption",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "simulate",   place.write("gel.toml", gel()),
                 "-o",       "out.run.h5", "--no-such-option"};
       },
       2,
       {"diastole: ", "--no-such-option", "--help"}},
      {"RigWithUnknownKey",
       [](Place place) {
         return simulate_in(place, with(source_text("examples/rig.toml"), "hose_bore_mm", "hose_bor_mm"));
       },
       2,
       {"bad.rig.toml", "rig.hose_bore_mm", "\"hose_bor_mm\" on line", "did you mean hose_bore_mm?"}},
      {"RigWithUnknownSimulationKey",
       [](Place place) {
         return simulate_in(place, source_text("examples/rig.toml") + "\n[simulation]\nC1 = 8.8\n");
       },
       2,
       {"bad.rig.toml", "simulation", "C1_kPa"}},
      {"NoDaemon",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "run",      place.write("gel.toml", gel()), "-o", "out.run.h5",
                 "--socket", "no.socket"};
       },
       3,
       {"no.socket", "diastole daemon"}},
      {"NoSerialPort",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "daemon", "--config",
                 place.write("rig.toml",
                             with(source_text("examples/rig.toml"), "/dev/ttyACM0", "/dev/no-such-port"))};
       },
       3,
       {"/dev/no-such-port", "no such serial port", "`port`"}},
      {"NotARunFile",
       [](Place place) -> std::vector<std::string> {
         return {"diastole", "inspect", place.write("text.run.h5", "not HDF5")};
       },
       2,
       {"text.run.h5"}},
      {"NoCommand", [](Place) -> std::vector<std::string> { return {"diastole"}; }, 2, {"--help"}},
  };
}

std::set<std::string> files_in(const Workplace& place) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(place.path())) {
    const std::string name = std::filesystem::relative(entry.path(), place.path());
    if (!name.starts_with("out-") && !name.starts_with("err-")) names.insert(name);
  }
  return names;
}

class BadInputTest : public testing::TestWithParam<BadInput> {};

TEST_P(BadInputTest, IsToldWithPlaceValueAndRemedyAndLeavesNothing) {
  const Workplace place;
  const std::vector<std::string> arguments = GetParam().arguments(place);
  const std::set<std::string> before = files_in(place);
  const Ended ended = run(place, arguments);
  EXPECT_EQ(ended.exit_code, GetParam().exit_code) << ended.err;
  for (const std::string& part : GetParam().message)
    EXPECT_THAT(ended.err, HasSubstr(part));
  EXPECT_THAT(ended.out, testing::IsEmpty());
  std::set<std::string> after = files_in(place);
  after.erase("journals");  // a daemon's, empty
  EXPECT_EQ(after, before);
}

INSTANTIATE_TEST_SUITE_P(Table, BadInputTest, testing::ValuesIn(table()),
                         [](const auto& each) { return each.param.name; });

/// What a command line is refused with.
std::string reported(const std::vector<std::string>& words) {
  const Workplace place;
  const Ended ended = run(place, words);
  EXPECT_EQ(ended.exit_code, 2);
  return ended.err;
}

TEST(BadOption, IsToldWithItsNameItsValueAndWhatIsExpected) {
  EXPECT_THAT(reported({"diastole", "simulate", "e.toml", "-o", "e.run.h5", "--seed", "many"}),
              testing::AllOf(HasSubstr("--seed: \"many\" is not a whole number"),
                             HasSubstr("`diastole simulate --help` explains it")));
  EXPECT_THAT(reported({"diastole", "solve", "gel.study.toml", "--pressure-kPa", "nan"}),
              HasSubstr("--pressure-kPa: nan is not a finite number"));
  EXPECT_THAT(reported({"diastole", "scan", "gel.study.toml", "-o", "scan", "--tag-angles", "0,inf"}),
              HasSubstr("--tag-angles: inf is not a finite number"));
  EXPECT_THAT(reported({"diastole", "scan", "gel.study.toml", "-o", "scan", "--period", "1,2"}),
              HasSubstr("--period: \"1,2\" is not a number"));
  EXPECT_THAT(reported({"diastole", "scan", "gel.study.toml", "-o", "scan", "--period", "-1"}),
              HasSubstr("--period: -1 is not above zero"));
  EXPECT_THAT(reported({"diastole", "fit", "gel.study.toml", "--geometry-sigma-mm", "0,25"}),
              HasSubstr("--geometry-sigma-mm: \"0,25\" is not a number"));
  EXPECT_THAT(reported({"diastole", "fit", "gel.study.toml", "--geometry-sigma-mm", "10.5"}),
              HasSubstr("--geometry-sigma-mm: 10.5 is not from 0 to 10"));
  EXPECT_THAT(reported({"diastole", "jog", "--mL", "5mL"}), HasSubstr("--mL: \"5mL\" is not a number"));
  EXPECT_THAT(reported({"diastole", "fit", "gel.study.toml", "--unexamind"}),
              testing::AllOf(HasSubstr("not expected: --unexamind. Did you mean \"--unexamined\"?"),
                             HasSubstr("`diastole fit --help` explains it")));
  EXPECT_THAT(reported({"diastole", "fit", "gel.study.toml", "--mehs", "4,2,1"}),
              HasSubstr("not expected: --mehs 4,2,1. Did you mean \"--mesh\"?"));
  EXPECT_THAT(reported({"diastole", "fit", "gel.study.toml", "other.study.toml", "--mehs=4,2,1"}),
              HasSubstr("not expected: other.study.toml --mehs=4,2,1. Did you mean \"--mesh\"?"));
}

TEST(MissingArgument, IsToldWithWhatItIsFor) {
  EXPECT_THAT(reported({"diastole", "flow", "scan"}),
              testing::AllOf(HasSubstr("--output is missing: flow and volume of each image phase"),
                             HasSubstr("`diastole flow --help` explains it")));
  EXPECT_THAT(reported({"diastole", "fit"}), HasSubstr("STUDY is missing: study file"));
  EXPECT_THAT(reported({"diastole", "mesh"}), HasSubstr("one of its commands is missing: import, export"));
  EXPECT_THAT(reported({"diastole", "--json"}), HasSubstr("a command is missing"));
}

TEST(MistypedFolder, IsNamedAsAWordThatStandsNowhere) {
  const Workplace place;
  (void)recording(place, "gel.run.h5");
  std::filesystem::create_directory(place / "empty");
  std::filesystem::create_directory(place / "other");
  const Ended mistyped = run(place, {"diastole", "runs", "nosuch"});
  EXPECT_EQ(mistyped.exit_code, 1);
  EXPECT_THAT(mistyped.err, HasSubstr("nosuch: is no folder"));
  const Ended second = run(place, {"diastole", "runs", "empty", "other", "--json"});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_EQ(second.json().at("matched"), 0);
  EXPECT_THAT(second.err, HasSubstr("other: is another folder"));
  EXPECT_EQ(run(place, {"diastole", "runs", "kind=fit"}).exit_code, 0);
}

TEST(BadMeshFile, IsToldWithoutTalkOfStudies) {
  const Workplace place;
  const Ended ended =
      run(place, {"diastole", "mesh", "import", "no.exnode", "no.exelem", "-o", "m.mesh.toml"});
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.err, testing::AllOf(HasSubstr("no.exnode"), HasSubstr("cannot be opened"),
                                        testing::Not(HasSubstr("study"))));
}

TEST(Help, SaysWhatStandardOutputHoldsAfterAnError) {
  const Workplace place;
  const Ended help = run(place, {"diastole", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, testing::AllOf(HasSubstr("--json"), HasSubstr("may be empty")));
}

TEST(BusyPort, ASecondDaemonAndASecondInstrumentSayWhoIsInTheWay) {
  const Workplace place;
  Program rig(place, {"sim_rig", "--link", "pump"});
  ASSERT_TRUE(rig.wait_for_text("modbus_port")) << rig.err();
  const std::string port = std::to_string(nlohmann::json::parse(rig.out())["modbus_port"].get<int>());
  place.write("rig.toml", source_text("examples/rig.toml"));
  const std::vector<std::string> daemon{"diastole", "daemon",           "--config",
                                        "rig.toml", "--port",           (place / "pump").string(),
                                        "--daq",    "127.0.0.1:" + port};
  auto first_arguments = daemon;
  first_arguments.insert(first_arguments.end(), {"--socket", (place / "first.socket").string()});
  Program first(place, first_arguments);
  ASSERT_TRUE(first.wait_for_text("ready")) << first.err();

  auto second_arguments = daemon;
  second_arguments.insert(second_arguments.end(), {"--socket", (place / "second.socket").string()});
  const Ended second = run(place, second_arguments);
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.err, testing::AllOf(HasSubstr("pump"), HasSubstr("in use")));

  const Ended instrument = run(place, {"sim_rig", "--modbus-port", port});
  EXPECT_EQ(instrument.exit_code, 3);
  EXPECT_THAT(instrument.err, testing::AllOf(HasSubstr(port), HasSubstr("another port")));

  first.signal(SIGTERM);
  EXPECT_EQ(first.wait().exit_code, 0);
  rig.signal(SIGTERM);
  EXPECT_EQ(rig.wait().exit_code, 0);
  EXPECT_FALSE(std::filesystem::is_symlink(place / "pump"));
}

}  // namespace
}  // namespace diastole::flow
