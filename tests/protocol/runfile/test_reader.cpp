#include "protocol/runfile/reader.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <functional>

#include "protocol/contract/input_error.hpp"
#include "tests/protocol/runfile/broken_runs.hpp"

namespace diastole::runfile {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

std::string refusal_of_file(const std::filesystem::path& path) {
  try {
    (void)read_run(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "(accepted)";
}

struct Rejection {
  std::string name;
  std::function<void(RunSketch&)> damage;
  std::vector<std::string> named;
};

class EveryRejection : public testing::TestWithParam<Rejection> {};

TEST_P(EveryRejection, NamesTheDatasetAndTheFirstOffendingIndex) {
  RunSketch sketch;
  GetParam().damage(sketch);
  const auto path = scratch_file(GetParam().name + ".run.h5");
  write_sketch(path, sketch);
  const std::string message = refusal_of_file(path);
  EXPECT_THAT(message, HasSubstr(path.string()));
  for (const std::string& part : GetParam().named)
    EXPECT_THAT(message, HasSubstr(part));
}

const std::vector<Rejection> rejections{
    {"ForeignFormat", [](RunSketch& s) { s.format = "other"; }, {"attribute format", "\"other\""}},
    {"NewerVersion", [](RunSketch& s) { s.format_version = 2; }, {"format_version", "newer", "Update"}},
    {"PressureInOtherUnits",
     [](RunSketch& s) { s.cavity_units = "Pa"; },
     {"/pressure/cavity_kPa, attribute units", "\"Pa\"", "convert"}},
    {"NonMonotonicPressureTime",
     [](RunSketch& s) {
       s.pressure_time_s = {0, 1, 1, 3};
     },
     {"/pressure/time_s, index 2"}},
    {"NonMonotonicPumpTime",
     [](RunSketch& s) {
       s.pump_time_s = {0, 2, 1, 3};
     },
     {"/pump/time_s, index 2"}},
    {"NonMonotonicTriggers",
     [](RunSketch& s) {
       s.trigger_s = {1, 0};
     },
     {"/trigger/time_s, index 1"}},
    {"ShortChannel",
     [](RunSketch& s) { s.cavity_kPa.pop_back(); },
     {"/pressure/cavity_kPa, index 3", "3 rows", "4"}},
    {"LongVolume", [](RunSketch& s) { s.commanded_mL.push_back(0); }, {"/pump/commanded_mL, index 4"}},
    {"TimeBeyondAnyRun", [](RunSketch& s) { s.trigger_s = {1e300}; }, {"/trigger/time_s, index 0", "1e+300"}},
    {"GapBeyondAnyRun",
     [](RunSketch& s) {
       s.gaps = {{"pressure", 1, 1LL << 62}};
     },
     {"/gaps, index 0", "4611686018427387904"}},
    {"UndeclaredNan",
     [](RunSketch& s) { s.cavity_kPa[1] = std::nan(""); },
     {"/pressure/cavity_kPa, index 1", "nan"}},
    {"NanBesideAGap",
     [](RunSketch& s) {
       s.cavity_kPa[1] = s.cavity_kPa[2] = std::nan("");
       s.gaps = {{"pressure", 1, 1}};
     },
     {"/pressure/cavity_kPa, index 2"}},
    {"GapOfAnotherStream",
     [](RunSketch& s) {
       s.cavity_kPa[1] = std::nan("");
       s.gaps = {{"pump", 1, 1}};
     },
     {"/pressure/cavity_kPa, index 1"}},
    {"InfinityInAGap",
     [](RunSketch& s) {
       s.cavity_kPa[1] = HUGE_VAL;
       s.gaps = {{"pressure", 1, 1}};
     },
     {"/pressure/cavity_kPa, index 1", "inf"}},
    {"NanTime", [](RunSketch& s) { s.pressure_time_s[3] = std::nan(""); }, {"/pressure/time_s, index 3"}},
    {"NanTimeInAGap",
     [](RunSketch& s) {
       s.pressure_time_s[3] = s.cavity_kPa[3] = std::nan("");
       s.gaps = {{"pressure", 3, 1}};
     },
     {"/pressure/time_s, index 3", "nan"}},
    {"NegativeGap",
     [](RunSketch& s) {
       s.gaps = {{"pressure", -1, 1}};
     },
     {"/gaps, index 0"}},
    {"NoGapsTable", [](RunSketch& s) { s.leave_out = "/gaps"; }, {"/gaps", "missing"}},
    {"NoCavity", [](RunSketch& s) { s.leave_out = "/pressure/cavity_kPa"; }, {"/pressure/cavity_kPa"}},
    {"NoTriggers", [](RunSketch& s) { s.leave_out = "/trigger/time_s"; }, {"/trigger/time_s", "missing"}},
};

INSTANTIATE_TEST_SUITE_P(Reader, EveryRejection, testing::ValuesIn(rejections),
                         [](const auto& each) { return each.param.name; });

class EitherText : public testing::TestWithParam<bool> {};

TEST_P(EitherText, FixedAndVariableLengthReadAlike) {
  RunSketch sketch;
  sketch.variable_length_texts = GetParam();
  sketch.cavity_kPa[2] = std::nan("");
  sketch.gaps = {{"pressure", 2, 1}};
  const auto path = scratch_file("sound.run.h5");
  write_sketch(path, sketch);
  const RecordedRun run = read_run(path);
  EXPECT_EQ(run.run_id, "00000000-0000");
  EXPECT_EQ(run.protocol_toml, "# experiment");
  EXPECT_EQ(std::get<int64_t>(run.rig.at("microsteps")), 8);
  EXPECT_EQ(std::get<std::string>(run.rig.at("specimen")), "gel");
  ASSERT_EQ(run.segments.size(), 1U);
  EXPECT_EQ(run.segments[0].waveform, "parabolic");
  EXPECT_DOUBLE_EQ(run.segments[0].end_s(), 2.5);
  EXPECT_THAT(run.pump.commanded_mL, ElementsAre(0, 10, 10, 0));
  EXPECT_TRUE(std::isnan(run.pressure.channels.at("cavity_kPa")[2]));
  ASSERT_EQ(run.gaps.size(), 1U);
  EXPECT_EQ(run.gaps[0].reason, "planted");
  EXPECT_EQ(run.missing("pressure"), 1);
  ASSERT_EQ(run.events.size(), 1U);
  EXPECT_EQ(run.events[0].code, "trigger");
}

INSTANTIATE_TEST_SUITE_P(Reader, EitherText, testing::Bool());

TEST(Reader, AFileThatIsNoRunFileIsRefused) {
  EXPECT_THAT(refusal_of_file("no/such.run.h5"),
              AllOf(HasSubstr("no/such.run.h5"), HasSubstr("cannot be opened")));
  const auto text = scratch_file("text.run.h5");
  std::ofstream(text) << "not a recording\n";
  EXPECT_THAT(refusal_of_file(text), HasSubstr("not an HDF5 file"));
}

TEST(Reader, ATruncatedFileIsRefusedAtEveryLength) {
  const auto whole = scratch_file("whole.run.h5");
  write_sketch(whole, {});
  const auto size = std::filesystem::file_size(whole);
  const auto cut = scratch_file("cut.run.h5");
  for (uintmax_t length = 0; length < size; length += 97) {
    std::filesystem::copy_file(whole, cut, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(cut, length);
    EXPECT_NE(refusal_of_file(cut), "(accepted)") << "cut to " << length << " bytes";
  }
}

}  // namespace
}  // namespace diastole::runfile
