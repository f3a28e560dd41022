#include "host/rig/session_so_far.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "host/journal/journal_store.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

const std::string study_toml =
    "format = \"diastole-experiment\"\nversion = 1\nrest_s = 0.1\n[[segment]]\nwaveform = \"parabolic\"\n"
    "stroke_mL = 10\nperiod_s = 0.5\n[schedule]\ndummy_cycles = 1\npause_cycles = "
    "1\n[[schedule.block]]\nname = "
    "\"tagged\"\nslices = 2\ncycles_per_slice = 3\n[[schedule.block]]\nname = \"tagged\"\ncycles_per_slice = "
    "2\n";

std::set<int64_t> imaged_in(const fs::path& journal) {
  return imaged_slices(parse_journal(JournalRecords(journal)), *schedule_of(study_toml, "study"));
}

double last_known_s(const std::vector<double>& time_s, const std::vector<double>& values) {
  for (size_t row = values.size(); row-- > 0;)
    if (!std::isnan(values[row])) return time_s[row];
  return 0;
}

/// By the run's rows: slices of whose last cycle both streams hold the end.
std::set<int64_t> whole_in(const runfile::RecordedRun& run) {
  std::set<int64_t> whole;
  const double until_s = std::min(last_known_s(run.pressure.time_s, run.pressure.channels.at("cavity_kPa")),
                                  last_known_s(run.pump.time_s, run.pump.commanded_mL));
  for (size_t i = 0; i < run.slices.size(); ++i) {
    const runfile::Slice& slice = run.slices[i];
    if (slice.triggers < slice.cycles) continue;
    const double end_s =
        run.segments[0].start_s + 0.5 * static_cast<double>(slice.first_trigger + slice.triggers);
    if (until_s + 2.0 / 300 >= end_s) whole.insert(static_cast<int64_t>(i));
  }
  return whole;
}

TEST(SessionSoFar, OfAStudyThatWasRunToItsEndIsAllOfIt) {
  SessionOnDesk session(study_toml);
  session.run();
  ASSERT_EQ(session.outcome.end, "completed");
  EXPECT_THAT(imaged_in(session.journal), ElementsAre(0, 1, 2));
}

TEST(SessionSoFar, EndsWithTheSliceThatAStopCutShort) {
  for (const auto how : {StopRequest::at_cycle_end, StopRequest::now}) {
    SessionOnDesk session(study_toml);
    session.run([&] { return session.client.last_known().triggers >= 8 ? how : StopRequest::none; });
    EXPECT_THAT(imaged_in(session.journal), ElementsAre(0)) << "the third cycle of slice 1 was not begun";
  }
}

TEST(SessionSoFar, IsWhatBothStreamsHoldWhereverTheJournalBreaksOff) {
  SessionOnDesk session(study_toml);
  session.run();
  const auto bytes = fs::file_size(session.journal);
  const fs::path cut = session.scratch / "cut.journal";
  std::set<int64_t> before;
  constexpr uintmax_t cuts = 80;
  for (uintmax_t k = 1; k < cuts; ++k) {
    fs::copy_file(session.journal, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, bytes * k / cuts);
    std::set<int64_t> imaged;
    try {
      const runfile::RecordedRun run = assemble_run(JournalRecords(cut)).run;
      imaged = imaged_in(cut);
      const std::set<int64_t> whole = whole_in(run);
      EXPECT_TRUE(std::ranges::includes(whole, imaged)) << "cut " << k << ": not all of it was recorded";
    } catch (const InputError&) {
      continue;  // nothing was recorded by then
    }
    EXPECT_TRUE(std::ranges::includes(imaged, before)) << "cut " << k;
    before = imaged;
  }
  EXPECT_THAT(before, ElementsAre(0, 1, 2)) << "the last cut lies behind the last cycle";
}

/// A journal that holds its beginning only.
void write_begin(const fs::path& path, BeginRecord begin) {
  JournalWriter writer(path);
  EXPECT_TRUE(append(writer, begin));
}

TEST(SessionSoFar, FollowsItsRunsAndNotTheWallClock) {
  const Scratch scratch("sessions");
  const Schedule schedule = *schedule_of(study_toml, "study");
  EXPECT_FALSE(last_session(scratch / "", study_toml, schedule)) << "no journal";
  const auto begin = [&](const std::string& id, const std::string& started_utc, const std::string& resumes,
                         std::vector<uint64_t> done, const std::string& experiment = study_toml) {
    BeginRecord record;
    record.run_id = id;
    record.started_utc = started_utc;
    record.experiment = experiment;
    record.resumes = resumes;
    record.slices_done = std::move(done);
    write_begin(scratch / (id + ".journal"), record);
  };
  begin("older", "2026-01-01T00:00:00Z", "", {});
  begin("first", "2026-01-02T00:00:00Z", "", {});
  begin("other", "2026-03-01T00:00:00Z", "", {}, study_toml + "# another\n");
  EXPECT_EQ(last_session(scratch / "", study_toml, schedule)->run_id, "first");
  begin("second", "2000-01-01T00:00:00Z", "first", {0});  // the clock lost its battery with the power
  begin("third", "2026-01-01T12:00:00Z", "second", {0, 1, 77});
  const auto session = last_session(scratch / "", study_toml, schedule);
  ASSERT_TRUE(session);
  EXPECT_EQ(session->run_id, "third");
  EXPECT_THAT(session->done, ElementsAre(0, 1)) << "and no slice that the study has not";
  std::ofstream(scratch / "zz-broken.journal") << "DJR1 and no record";
  EXPECT_EQ(last_session(scratch / "", study_toml, schedule)->run_id, "third");
}

}  // namespace
}  // namespace diastole
