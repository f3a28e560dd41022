// What the writer leaves on the disk, read by ourselves, by h5py and by h5dump.

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/runfile/assemble.hpp"
#include "host/runfile/writer.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"
#include "tests/host/runfile/output_of.hpp"

namespace diastole {
namespace {

/// One desk session with a gap of three samples, recorded once for all tests here.
class WrittenFile : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    session_ = new SessionOnDesk(short_session);
    session_->instrument.fault = [](uint64_t reading) {
      return reading >= 100 && reading < 103 ? daq::Outcome{false, "no answer"} : daq::Outcome{};
    };
    session_->run();
    write_run(file(), session_->assemble().run);
  }
  static void TearDownTestSuite() { delete std::exchange(session_, nullptr); }
  static std::filesystem::path file() { return session_->scratch / "written.run.h5"; }
  static inline SessionOnDesk* session_ = nullptr;
};

TEST_F(WrittenFile, ReadsBackAsItWasAssembled) {
  const runfile::RecordedRun before = session_->assemble().run;
  const runfile::RecordedRun after = runfile::read_run(file());
  EXPECT_EQ(after.run_id, before.run_id);
  EXPECT_EQ(after.rig, before.rig);
  EXPECT_EQ(after.protocol_toml, session_->experiment.text);
  EXPECT_EQ(after.pressure.time_s, before.pressure.time_s);
  EXPECT_EQ(after.pump.commanded_mL, before.pump.commanded_mL);
  EXPECT_EQ(after.trigger_s, before.trigger_s);
  EXPECT_EQ(after.clock, before.clock);
  EXPECT_EQ(after.missing("pressure"), 3);
  EXPECT_EQ(after.events.size(), before.events.size());
}

TEST_F(WrittenFile, HoldsTheLowPassedPressureBesideTheRawOne) {
  const runfile::RecordedRun run = runfile::read_run(file());
  const auto& raw_kPa = run.pressure.channels.at("cavity_kPa");
  const auto& filtered_kPa = run.pressure.channels.at("cavity_filtered_kPa");
  ASSERT_EQ(filtered_kPa.size(), raw_kPa.size());
  size_t missing = 0;
  for (size_t i = 0; i < raw_kPa.size(); ++i) {
    missing += std::isnan(raw_kPa[i]) ? 1 : 0;
    EXPECT_EQ(std::isnan(filtered_kPa[i]), std::isnan(raw_kPa[i])) << "row " << i;
  }
  EXPECT_EQ(missing, 3U);
  const auto& notes = run.pressure.notes.at("cavity_filtered_kPa");
  EXPECT_DOUBLE_EQ(std::get<double>(notes.at("cutoff_Hz")), 30);
  EXPECT_EQ(std::get<int64_t>(notes.at("passes")), 2);
  EXPECT_DOUBLE_EQ(std::get<double>(notes.at("delay_s")), 0);
  EXPECT_FALSE(run.pressure.notes.contains("cavity_kPa"));
}

TEST(FilteredChannel, IsLeftOutWhereSamplesAreTooSlowForIt) {
  EXPECT_FALSE(filter_of(0));
  EXPECT_FALSE(filter_of(1 / 60.0));
  EXPECT_TRUE(filter_of(1 / 100.0));
}

TEST_F(WrittenFile, FromTheJournalsRowsIsTheSameAsFromMemory) {
  const std::filesystem::path streamed = session_->scratch / "streamed.run.h5";
  const StreamedRun run = stream_run(JournalRecords(session_->journal));
  EXPECT_TRUE(run.assembled.run.pressure.time_s.empty());
  EXPECT_EQ(write_run(streamed, run), "");
  const runfile::RecordedRun a = runfile::read_run(file()), b = runfile::read_run(streamed);
  EXPECT_EQ(a.pressure.time_s, b.pressure.time_s);
  EXPECT_EQ(a.pump.commanded_mL, b.pump.commanded_mL);
  EXPECT_EQ(a.pressure.channels.size(), b.pressure.channels.size());
  EXPECT_EQ(a.pressure.notes, b.pressure.notes);
  EXPECT_EQ(a.gaps.size(), b.gaps.size());
  EXPECT_EQ(a.trigger_s, b.trigger_s);
}

TEST_F(WrittenFile, ADirectoryThatIsNotFlushedIsToldAndTheFileIsWhole) {
  const std::filesystem::path path = session_->scratch / "unconfirmed.run.h5";
  const auto refuses = [](int) {
    errno = EIO;
    return -1;
  };
  const std::string remark = write_run(path, session_->assemble().run, refuses);
  EXPECT_THAT(remark, testing::AllOf(testing::HasSubstr("unconfirmed.run.h5 is whole"),
                                     testing::HasSubstr("Input/output error")));
  EXPECT_NO_THROW((void)runfile::read_run(path));
}

TEST_F(WrittenFile, H5pyFindsTheContract) {
  const std::string script = std::string(DIASTOLE_SOURCE_DIR) + "/tests/host/runfile/check_contract.py";
  const Output output = output_of("/usr/bin/python3 " + script + " " + file().string());
  if (output.text.find("No module named 'h5py'") != std::string::npos)
    GTEST_SKIP() << "python3-h5py is absent";
  EXPECT_EQ(output.status, 0) << output.text;
}

TEST_F(WrittenFile, H5dumpReadsIt) {
  const Output output = output_of("h5dump -d /gaps " + file().string());
  if (output.status != 0 && output.text.find("not found") != std::string::npos) GTEST_SKIP() << "no h5dump";
  EXPECT_EQ(output.status, 0);
  EXPECT_THAT(output.text, testing::HasSubstr("no answer"));
}

TEST_F(WrittenFile, AnUnsoundRunOrAnImpossiblePlaceLeavesNothingBehind) {
  runfile::RecordedRun broken = session_->assemble().run;
  broken.pressure.time_s[5] = broken.pressure.time_s[4];
  EXPECT_THROW(write_run(session_->scratch / "broken.run.h5", broken), InputError);
  EXPECT_THROW(write_run(session_->scratch / "no/such/dir.run.h5", session_->assemble().run), HardwareError);
  for (const auto& entry : std::filesystem::directory_iterator(session_->scratch.path()))
    EXPECT_THAT(entry.path().string(), testing::Not(testing::HasSubstr("part")));
  EXPECT_FALSE(std::filesystem::exists(session_->scratch / "broken.run.h5"));
}

TEST_F(WrittenFile, AJournalCutAnywhereGivesASoundPrefixOrARefusal) {
  std::ifstream stream(session_->journal, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const std::vector<uint8_t> bytes(chars.begin(), chars.end());
  const size_t whole_rows = session_->assemble().run.pressure.time_s.size();
  size_t recovered = 0;
  size_t most_rows = 0;
  for (size_t length = 0; length < bytes.size(); length += 61) {
    try {
      const AssembledRun assembled = assemble_run(read_journal(std::span(bytes).first(length)));
      EXPECT_NO_THROW(runfile::check(assembled.run)) << "cut at " << length;
      EXPECT_FALSE(assembled.ended_in_order);
      most_rows = std::max(most_rows, assembled.run.pressure.time_s.size());
      ++recovered;
    } catch (const InputError&) {
      EXPECT_EQ(recovered, 0U) << "a longer journal gave less, at " << length;
    }
  }
  EXPECT_GT(recovered, 50U);
  EXPECT_GE(most_rows + 31, whole_rows);  // a block of samples spans 0.1 s
}

TEST_F(WrittenFile, SegmentsThatDidNotBeginKeepTheirPlannedDistance) {
  JournalContents journal = read_journal(session_->journal);
  const double begun_s = session_->assemble().run.segments.at(0).start_s;
  for (JournalRecord& record : journal.records) {
    if (record.kind != RecordKind::document) continue;
    auto document = nlohmann::json::parse(record.payload);
    if (document.at("record") != "begin") continue;
    auto& segments = document.at("segments");
    segments.at(0)["start_s"] = 0.1;  // planned much earlier than it began
    segments.push_back(segments.at(0));
    segments.at(1)["start_s"] = 0.5;
    const std::string text = document.dump();
    record.payload.assign(text.begin(), text.end());
  }
  const runfile::RecordedRun run = assemble_run(journal).run;
  EXPECT_NO_THROW(runfile::check(run));
  ASSERT_EQ(run.segments.size(), 2U);
  EXPECT_DOUBLE_EQ(run.segments[0].start_s, begun_s);
  EXPECT_NEAR(run.segments[1].start_s, begun_s + 0.4, 1e-9);
}

TEST_F(WrittenFile, ADamagedRecordBecomesAGapNeverAWrongRow) {
  const JournalContents whole = read_journal(session_->journal);
  JournalContents damaged = whole;
  size_t lost_samples = 0;
  for (auto record = damaged.records.begin(); record != damaged.records.end(); ++record) {
    if (record->kind != RecordKind::samples || record->sequence < 60) continue;
    lost_samples = decode_samples(record->payload)->host_ns.size();
    damaged.records.erase(record);
    break;
  }
  ASSERT_GT(lost_samples, 0U);
  const AssembledRun assembled = assemble_run(damaged);
  EXPECT_NO_THROW(runfile::check(assembled.run));
  EXPECT_EQ(assembled.samples_missing, 3 + lost_samples);
}

/// Whole by its CRC, and no record that we write.
const std::vector<std::string> nonsense{
    R"({"record":"gap","first_index":3,"count":1152921504606846976,"reason":"no answer"})",
    R"({"record":"gap","first_index":-1,"count":1,"reason":"no answer"})",
    R"({"record":"trigger","cycle":4611686018427387904,"tick":100})",
    R"({"record":"trigger","cycle":1,"tick":1e300})",
    R"({"record":"trigger","cycle":"one","tick":100})",
    R"({"record":"slice","block":7,"slice":0,"cycle":0,"cycles":2,"dummy_cycles":0})",
    R"({"record":"event","level":"info","code":"x"})",
    R"({"record":"clock","host_ns":-1,"tick":1,"half_round_trip_ns":1})",
    R"({"record":"run_ended","reason":"completed","tick":1,"cycles":2.5,"triggers":2})",
    R"({"record":"begin","run_id":1})",
    R"({"record":["begin"]})",
    std::string(100'000, '[')};

TEST_F(WrittenFile, ARecordThatSaysWhatNoneOfOursSaysIsLeftOut) {
  const JournalContents whole = read_journal(session_->journal);
  const AssembledRun before = assemble_run(whole);
  for (const std::string& text : nonsense) {
    JournalContents journal = whole;
    journal.records.push_back({RecordKind::document, 0, {text.begin(), text.end()}});
    journal.records.push_back(
        {RecordKind::samples, 0, encode(SampleBlock{uint64_t{1} << 60U, 1, {5}, {1.0}})});
    journal.records.push_back({RecordKind::positions, 0, encode(PositionBlock{~0U, 1, 1, {1}})});
    const AssembledRun after = assemble_run(journal);
    EXPECT_NO_THROW(runfile::check(after.run)) << text;
    EXPECT_EQ(after.run.pressure.time_s, before.run.pressure.time_s) << text;
    EXPECT_EQ(after.run.trigger_s, before.run.trigger_s) << text;
    EXPECT_EQ(after.run.gaps.size(), before.run.gaps.size()) << text;
    EXPECT_TRUE(after.ended_in_order) << text;
  }
}

TEST_F(WrittenFile, ABeginningWithoutAFieldIsRefused) {
  for (const char* field : {"channels", "tick_rate_Hz", "segments", "rig"}) {
    JournalContents journal = read_journal(session_->journal);
    auto begin = nlohmann::json::parse(journal.records.front().payload);
    begin.erase(field);
    const std::string text = begin.dump();
    journal.records.front().payload.assign(text.begin(), text.end());
    EXPECT_THAT(message_of<InputError>([&] { (void)assemble_run(journal); }),
                testing::HasSubstr("lost its first record"))
        << field;
  }
}

}  // namespace
}  // namespace diastole
