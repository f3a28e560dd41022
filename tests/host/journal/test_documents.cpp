#include <gmock/gmock.h>

#include "host/journal/journal_records.hpp"

namespace diastole {
namespace {

std::optional<Document> decoded(const std::string& text) {
  return decode_document({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

/// Each kind with its bytes, which journals of all versions hold.
const std::vector<std::pair<Document, std::string>> golden{
    {BeginRecord{.run_id = "id",
                 .started_utc = "2026-01-02T03:04:05Z",
                 .producer = "test",
                 .experiment = "text",
                 .experiment_file = "e.toml",
                 .sample_rate_Hz = 300,
                 .channels = {"cavity"},
                 .rig = {{"bore_mm", 100.0}, {"microsteps", int64_t{8}}, {"specimen", "gel"}},
                 .instrument = "simulated",
                 .tick_rate_Hz = 84'000'000,
                 .microstep_pL = 7'791'649,
                 .daq_timer_rate_Hz = 40e6,
                 .daq_timer_counts_samples = false,
                 .segments = {{0.1, "uploaded", 10, 0.8, 0, 2}},
                 .trigger_delay_s = 0.05,
                 .waveforms = {{0, "phase,fraction", {0, 1, 0}}},
                 .session = {{{"specimen", "gel-7"}}, {{"2026-01-02T03:04:05Z", "Jo", "new hose"}}},
                 .resumes = "id-before",
                 .slices_done = {0, 2}},
     R"({"channels":["cavity"],"daq_timer_counts_samples":false,"daq_timer_rate_Hz":40000000.0,)"
     R"("experiment":"text","experiment_file":"e.toml","instrument":"simulated","microstep_pL":7791649,)"
     R"("notes":[{"author":"Jo","text":"new hose","written_utc":"2026-01-02T03:04:05Z"}],)"
     R"("producer":"test","record":"begin","resumes":"id-before","rig":{"bore_mm":100.0,"microsteps":8,"specimen":"gel"},)"
     R"("run_id":"id","sample_rate_Hz":300.0,"segments":[{"cycles":2,"offset_mL":0.0,"period_s":0.8,)"
     R"("start_s":0.1,"stroke_mL":10.0,"waveform":"uploaded"}],"session":{"specimen":"gel-7"},"slices_done":[0,2],"started_utc":"2026-01-02T03:04:05Z",)"
     R"("tick_rate_Hz":84000000,"trigger_delay_s":0.05,"waveforms":[{"fraction":[0.0,1.0,0.0],)"
     R"("points":"phase,fraction","segment":0}]})"},
    {GridRecord{7}, R"({"first_due_ns":7,"record":"grid"})"},
    {GapRecord{3, 2, "no answer"}, R"({"count":2,"first_index":3,"reason":"no answer","record":"gap"})"},
    {ClockRecord{1, 2, 3}, R"({"half_round_trip_ns":3,"host_ns":1,"record":"clock","tick":2})"},
    {InstrumentClockRecord{1, 2, 3},
     R"({"half_round_trip_ns":3,"host_ns":1,"record":"daq_clock","timer":2})"},
    {RunStartedRecord{5}, R"({"record":"run_started","tick":5})"},
    {SegmentRecord{1, 5}, R"({"record":"segment","segment":1,"tick":5})"},
    {TriggerRecord{1, 5, 1}, R"({"cycle":1,"r_wave":1,"record":"trigger","tick":5})"},
    {SliceRecord{"tagged", 0, 3, 2, 1},
     R"({"block":"tagged","cycle":3,"cycles":2,"dummy_cycles":1,"record":"slice","slice":0})"},
    {RunEndedRecord{"completed", false, 9, 2, 2, 1},
     R"({"cycles":2,"r_waves":1,"reason":"completed","record":"run_ended","schedule_done":false,"tick":9,)"
     R"("triggers":2})"},
    {EventRecord{5, 0, "error", "estop", "x"},
     R"({"code":"estop","level":"error","record":"event","text":"x","tick":5})"},
    {EventRecord{{}, 6, "info", "stop", "x"},
     R"({"code":"stop","host_ns":6,"level":"info","record":"event","text":"x"})"},
    {EndRecord{8}, R"({"record":"end","until_ns":8})"}};

TEST(Documents, HaveTheirBytesAndComeBack) {
  for (const auto& [document, text] : golden) {
    EXPECT_EQ(encode(document), text);
    const auto read = decoded(text);
    ASSERT_TRUE(read) << text;
    EXPECT_EQ(read->index(), document.index());
    EXPECT_EQ(encode(*read), text);
  }
}

TEST(Documents, WithoutAFieldThatWasAddedLaterAreRead) {
  EXPECT_TRUE(decoded(R"({"record":"end"})"));
  EXPECT_TRUE(decoded(R"({"record":"trigger","cycle":1,"tick":5})"));
  EXPECT_TRUE(decoded(R"({"record":"run_ended","reason":"completed","tick":9,"cycles":2,"triggers":2})"));
  EXPECT_TRUE(decoded(
      R"({"record":"begin","run_id":"id","started_utc":"","producer":"","experiment":"","channels":["cavity"],)"
      R"("sample_rate_Hz":300.0,"rig":{},"tick_rate_Hz":84000000,"microstep_pL":1,"daq_timer_rate_Hz":40000000,)"
      R"("segments":[]})"));
}

TEST(Documents, OfNoFormOfOursAreNone) {
  for (
      const char* text :
      {R"({"record":"trigger","cycle":1})", R"({"record":"trigger","cycle":-1,"tick":5})",
       R"({"record":"clock","host_ns":1.5,"tick":2,"half_round_trip_ns":3})",
       R"({"record":"begin","run_id":"id","started_utc":"","producer":"","experiment":"","channels":["cavity"],"sample_rate_Hz":300.0,"rig":{},"tick_rate_Hz":84000000,"microstep_pL":1,"daq_timer_rate_Hz":40000000,"segments":[],"slices_done":[-1]})",
       R"({"record":"other"})", R"({"record":7})", R"([1])", "{", ""})
    EXPECT_FALSE(decoded(text)) << text;
}

}  // namespace
}  // namespace diastole
