#include "host/acquisition/acquisition.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/soundness.hpp"
#include "protocol/signal/saturation.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"

namespace diastole {
namespace {

using runfile::RecordedRun;

/// What holds for every run, whatever went wrong: rows = received + missing, and each missing row is
/// declared.
void expect_books_balance(const AssembledRun& assembled) {
  const RecordedRun& run = assembled.run;
  EXPECT_NO_THROW(runfile::check(run));
  EXPECT_EQ(run.pressure.time_s.size(), assembled.samples_received + assembled.samples_missing);
  EXPECT_EQ(run.missing("pressure"), static_cast<int64_t>(assembled.samples_missing));
  const auto& cavity = run.pressure.channels.at("cavity_kPa");
  const auto nans = std::count_if(cavity.begin(), cavity.end(), [](double p) { return std::isnan(p); });
  EXPECT_EQ(nans, static_cast<int64_t>(assembled.samples_missing));
}

TEST(Acquisition, ASoundSessionMissesNothing) {
  SessionOnDesk session(short_session);
  session.run();
  EXPECT_EQ(session.outcome.end, "completed");
  EXPECT_EQ(session.outcome.cycles, 2U);
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  EXPECT_TRUE(assembled.ended_in_order);
  EXPECT_EQ(assembled.samples_missing, 0U);
  const RecordedRun& run = assembled.run;
  const runfile::Soundness soundness = runfile::assess(run);
  EXPECT_THAT(soundness.problems, testing::IsEmpty());
  // 0.1 s of rest, two cycles of 0.8 s and 0.25 s after the last step, at 300 Hz.
  EXPECT_NEAR(static_cast<double>(run.pressure.time_s.size()), 585, 5);
  ASSERT_EQ(run.trigger_s.size(), 2U);
  // The trigger rises with the first step, which a parabola from rest makes 5.6 ms into the cycle.
  EXPECT_NEAR(run.trigger_s[0], 0.1056, 1e-4);
  EXPECT_NEAR(run.trigger_s[1] - run.trigger_s[0], 0.8, 1e-6);
  EXPECT_NEAR(run.segments[0].start_s, 0.1, 1e-4);
  EXPECT_THAT(runfile::bin_frames(run, {.frames = 8}).excluded, testing::IsEmpty());
  EXPECT_GE(soundness.pump.rate_Hz, 299.9);
  EXPECT_NEAR(*std::max_element(run.pump.commanded_mL.begin(), run.pump.commanded_mL.end()), 10, 0.02);
  EXPECT_NEAR(run.pump.commanded_mL.back(), 0, 0.02);
}

TEST(Acquisition, PressureTimesAreOnTheControllersClock) {
  SessionOnDesk session(short_session);
  session.instrument.clock_error_ppm = 120;
  session.run();
  const RecordedRun run = session.assemble().run;
  // The instrument reads 0.5 V + 0.1 V/s of desk time; kPa_per_V is 4: the pressure tells the true time.
  const auto& cavity = run.pressure.channels.at("cavity_kPa");
  const auto desk_s = [&](size_t row) { return (cavity[row] / 4 - 0.5) / 0.1; };
  for (size_t row = 0; row < cavity.size(); row += 50) {
    EXPECT_NEAR(run.pressure.time_s[row] - run.pressure.time_s[0], desk_s(row) - desk_s(0), 1e-4);
  }
  EXPECT_NEAR(run.clock.at("host_drift_ppm"), 0, 200);  // 1.7 s of pairs to 0.1 ms
  EXPECT_NEAR(run.clock.at("daq_drift_ppm") - run.clock.at("host_drift_ppm"), 120, 5);
}

TEST(Acquisition, FailedReadingsAreCountedExactlyAndNeverInterpolated) {
  SessionOnDesk session(short_session);
  session.instrument.fault = [](uint64_t reading) {
    return reading >= 100 && reading < 107 ? daq::Outcome{false, "no answer"} : daq::Outcome{};
  };
  session.run();
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  EXPECT_EQ(assembled.samples_missing, 7U);
  EXPECT_EQ(session.outcome.counts.missing, 7U);
  ASSERT_EQ(assembled.run.gaps.size(), 1U);
  EXPECT_EQ(assembled.run.gaps[0].count, 7);
  EXPECT_EQ(assembled.run.gaps[0].reason, "no answer");
  EXPECT_FALSE(runfile::assess(assembled.run).sound());
}

/// Waves of 6 V at 5 Hz, which the instrument shows in millivolts up to 5 V, with a flicker of one.
TEST(Acquisition, SamplesBeyondTheInstrumentsRangeAreToldAtOnceAndCounted) {
  SessionOnDesk session(short_session);
  std::mt19937 random(5);
  session.instrument.volts_at = [&](double time_s) {
    const double flicker = 1e-3 * static_cast<double>(random() % 2);
    const double volts = std::round(6000.0 * std::sin(2.0 * std::numbers::pi * 5.0 * time_s)) / 1000.0;
    return std::clamp(volts + flicker, -5.0, 5.0);
  };
  session.run();
  const RecordedRun run = session.assemble().run;
  const auto& cavity = run.pressure.channels.at("cavity_kPa");
  const double least = std::ranges::min(cavity), most = std::ranges::max(cavity);
  const auto at_the_end =
      std::ranges::count_if(cavity, [&](double value) { return value == least || value == most; });
  EXPECT_GT(at_the_end, 100);
  const auto saturated = static_cast<int64_t>(session.outcome.counts.saturated);
  EXPECT_LE(saturated, at_the_end);
  EXPECT_GT(saturated, at_the_end - signal::SaturationWatch::kLeastRun) << "all but where the recording ends";
  EXPECT_EQ(runfile::assess(run).saturated.at("cavity_kPa"), saturated);
  const auto reported = std::ranges::find(session.remarks, "saturated", &RunRemark::code);
  ASSERT_NE(reported, session.remarks.end());
  EXPECT_EQ(reported->level, "warning");
  EXPECT_THAT(session.remarks.back().text,
              testing::HasSubstr(fmt::format("{} samples of cavity", saturated)));
}

/// A journal that ends before its record number `records`, as that of a daemon that was killed.
AssembledRun killed_after(const SessionOnDesk& session, size_t records) {
  JournalContents journal = read_journal(session.journal);
  journal.records.resize(std::min(records, journal.records.size()));
  return assemble_run(journal);
}

TEST(Acquisition, AKillWithinAStallLeavesNoSampleUndeclared) {
  SessionOnDesk session(short_session);
  session.instrument.fault = [](uint64_t reading) {
    return reading >= 150 ? daq::Outcome{false, "no answer"} : daq::Outcome{};
  };
  session.run();
  const size_t records = read_journal(session.journal).records.size();
  size_t gaps_before_the_end = 0;
  for (size_t kept = records / 2; kept < records; ++kept) {
    SCOPED_TRACE(kept);
    const AssembledRun assembled = killed_after(session, kept);
    expect_books_balance(assembled);
    EXPECT_FALSE(assembled.ended_in_order);
    const RecordedRun& run = assembled.run;
    const double last_s = std::max(run.pump.time_s.back(), run.trigger_s.back());
    EXPECT_GT(run.pressure.time_s.back(), last_s - 1.5 / 300);
    EXPECT_EQ(run.pressure.grid->rows(), std::ssize(run.pressure.time_s));
    EXPECT_EQ(run.events.back().code, "incomplete");
    EXPECT_GE(run.events.back().time_s, last_s);
    gaps_before_the_end = run.gaps.empty() ? 0 : std::max(gaps_before_the_end, run.gaps.size());
    // The growing gap reached the journal: what is only inferred is young.
    EXPECT_LT(run.gaps.back().reason == "not recorded" ? run.gaps.back().count : 0, 0.5 * 300);
  }
  EXPECT_LE(gaps_before_the_end, 4U) << "parts of one gap are one gap, those of the pump beside it";
}

TEST(Acquisition, RowsThatWereDueAreDeclaredWhenTheJournalEndsBehindAHungReading) {
  SessionOnDesk session(short_session);
  session.instrument.delay_ns = [](uint64_t reading) {
    return reading == 200 ? uint64_t{900'000'000} : uint64_t{0};
  };
  session.run();
  JournalContents journal = read_journal(session.journal);
  std::erase_if(journal.records, [](const JournalRecord& record) {
    const std::string text(record.payload.begin(), record.payload.end());
    return record.kind == RecordKind::document &&
           (text.find("\"gap\"") != std::string::npos || text.find("\"end\"") != std::string::npos);
  });
  const AssembledRun assembled = assemble_run(journal);
  expect_books_balance(assembled);
  EXPECT_GT(assembled.samples_missing, 250U);
  EXPECT_FALSE(assembled.ended_in_order);
}

TEST(Acquisition, TheFileTellsFromTheClocksHowManyRowsThereMustBe) {
  SessionOnDesk session(short_session);
  session.instrument.fault = [](uint64_t reading) {
    return reading % 50 == 7 ? daq::Outcome{false, "no answer"} : daq::Outcome{};
  };
  session.run();
  const RecordedRun run = session.assemble().run;
  ASSERT_TRUE(run.pressure.grid && run.pump.grid);
  EXPECT_EQ(run.pressure.grid->rows(), std::ssize(run.pressure.time_s));
  EXPECT_EQ(run.pump.grid->rows(), std::ssize(run.pump.time_s));
  EXPECT_NEAR(run.pump.grid->end_s, run.pump.time_s.back(), 1e-9);
  EXPECT_NEAR(run.pressure.grid->rate_Hz, 300, 0.1);
  EXPECT_NEAR(run.pressure.grid->end_s, run.pressure.time_s.back(), 1e-3);
  // A quarter of a second behind the last step.
  EXPECT_NEAR(run.pressure.grid->end_s - run.pump.grid->end_s, 0.25, 0.02);
}

class Stall : public testing::TestWithParam<int> {};

TEST_P(Stall, AnInstrumentThatStallsCostsThoseSamplesAndNoOthers) {
  SessionOnDesk session(short_session);
  const auto stall_ns = static_cast<uint64_t>(GetParam()) * 1'000'000;
  session.instrument.delay_ns = [stall_ns](uint64_t reading) {
    return reading == 200 ? stall_ns : uint64_t{0};
  };
  session.instrument.fault = [](uint64_t reading) {
    return reading == 200 ? daq::Outcome{false, "no answer within 20 ms"} : daq::Outcome{};
  };
  session.run();
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  // The reading itself, and every sample that came due while it hung.
  const double due = 0.3 * GetParam();
  EXPECT_NEAR(static_cast<double>(session.outcome.counts.missing), due, 1.01);
  EXPECT_EQ(assembled.run.trigger_s.size(), 2U);
}

INSTANTIATE_TEST_SUITE_P(Acquisition, Stall, testing::Values(10, 57, 200, 450));

TEST(Acquisition, AStallOfManyReadingsIsOneGapAndTwoRemarks) {
  SessionOnDesk session(short_session);
  const auto stalls = [](uint64_t reading) { return reading >= 200 && reading < 230; };
  session.instrument.delay_ns = [&](uint64_t reading) {
    return stalls(reading) ? uint64_t{20'000'000} : uint64_t{0};
  };
  session.instrument.fault = [&](uint64_t reading) {
    return stalls(reading) ? daq::Outcome{false, "no answer within 20 ms"} : daq::Outcome{};
  };
  session.run();
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  ASSERT_EQ(assembled.run.gaps.size(), 1U);
  EXPECT_EQ(assembled.run.gaps[0].reason, "no answer within 20 ms");
  EXPECT_NEAR(static_cast<double>(assembled.run.gaps[0].count), 180, 5);
  ASSERT_EQ(session.remarks.size(), 2U);
  EXPECT_THAT(session.remarks[0].text, testing::HasSubstr("no answer within 20 ms"));
  EXPECT_THAT(session.remarks[1].text,
              testing::HasSubstr("cost " + std::to_string(assembled.run.gaps[0].count) + " samples"));
}

TEST(Acquisition, AnInstrumentTooSlowForTheRateDrownsNoEmergencyStop) {
  SessionOnDesk session(short_session);
  session.instrument.delay_ns = [](uint64_t) { return uint64_t{4'000'000}; };
  session.clock.each_turn = [&] {
    if (session.instrument.readings == 240) session.desk.controller->set_estop(true);
  };
  session.run();
  EXPECT_EQ(session.outcome.end, "faulted");
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  EXPECT_GT(assembled.run.gaps.size(), 40U) << "the file has every one of them";
  EXPECT_LE(session.remarks.size(), 8U);
  EXPECT_EQ(std::ranges::count(session.remarks, "estop", &RunRemark::code), 1);
  uint64_t reported = 0;
  for (const RunRemark& remark : session.remarks) {
    uint64_t gaps = 0, samples = 0;
    if (std::sscanf(remark.text.c_str(), "%lu gap%*[s,] %lu", &gaps, &samples) == 2) reported += samples;
    if (std::sscanf(remark.text.c_str(), "the gap cost %lu", &samples) == 1) reported += samples;
  }
  EXPECT_EQ(reported, session.outcome.counts.missing);
}

TEST(Acquisition, ASlowAnswerIsNotBlamedOnTheHost) {
  SessionOnDesk session(short_session);
  session.instrument.delay_ns = [](uint64_t reading) {
    return reading == 200 ? uint64_t{15'000'000} : uint64_t{0};
  };
  session.run();
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  ASSERT_EQ(assembled.run.gaps.size(), 1U);
  EXPECT_THAT(assembled.run.gaps[0].reason, testing::HasSubstr("the instrument"));
}

TEST(Acquisition, ARunWithoutASingleSampleHasItsTimesAndItsGap) {
  SessionOnDesk session(short_session);
  session.instrument.fault = [](uint64_t) { return daq::Outcome{false, "no answer"}; };
  session.run();
  EXPECT_EQ(session.outcome.end, "completed");
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  EXPECT_EQ(assembled.samples_received, 0U);
  const RecordedRun& run = assembled.run;
  EXPECT_EQ(run.missing("pressure"), static_cast<int64_t>(run.pressure.time_s.size()));
  EXPECT_NEAR(static_cast<double>(run.pressure.time_s.size()), 585, 5);
  ASSERT_FALSE(run.pressure.time_s.empty());
  EXPECT_NEAR(run.pressure.time_s.front(), 0, 0.01);
  EXPECT_NEAR(run.pressure.time_s.back(), 1.95, 0.02);
  const runfile::Soundness soundness = runfile::assess(run);
  EXPECT_NEAR(soundness.pressure.rate_Hz, 300, 0.1);
  EXPECT_THAT(soundness.problems, testing::Contains(testing::HasSubstr("no pressure was recorded")));
}

TEST(Acquisition, RowsMissingAtTheEdgesLieOnTheGrid) {
  SessionOnDesk session(short_session);
  session.instrument.fault = [](uint64_t reading) {
    return reading < 50 || reading > 400 ? daq::Outcome{false, "no answer"} : daq::Outcome{};
  };
  session.run();
  const RecordedRun run = session.assemble().run;
  EXPECT_NO_THROW(runfile::check(run));
  SessionOnDesk sound(short_session);
  sound.run();
  const RecordedRun whole = sound.assemble().run;
  ASSERT_EQ(run.pressure.time_s.size(), whole.pressure.time_s.size());
  for (size_t row = 0; row < whole.pressure.time_s.size(); row += 20)
    EXPECT_NEAR(run.pressure.time_s[row], whole.pressure.time_s[row], 2e-4) << row;
}

TEST(Acquisition, StopAtCycleEndEndsWithAWholeCycle) {
  SessionOnDesk session(short_session);
  const uint64_t asked_at = 300;
  session.run([&] {
    return session.instrument.readings > asked_at - 200 ? StopRequest::at_cycle_end : StopRequest::none;
  });
  EXPECT_EQ(session.outcome.end, "stopped_at_cycle_end");
  EXPECT_EQ(session.outcome.cycles, 1U);
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  EXPECT_EQ(assembled.run.trigger_s.size(), 1U);
  EXPECT_NEAR(assembled.run.pump.commanded_mL.back(), 0, 0.02);
}

TEST(Acquisition, StopNowKeepsWhatWasRecorded) {
  SessionOnDesk session(short_session);
  session.run([&] { return session.instrument.readings > 100 ? StopRequest::now : StopRequest::none; });
  EXPECT_EQ(session.outcome.end, "stopped_now");
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  EXPECT_GT(assembled.samples_received, 100U);
}

/// Stops a run at `stop_ns` on the desk's clock.
void stop_at(SessionOnDesk& session, uint64_t stop_ns, StopRequest how) {
  session.run([&session, stop_ns, how] { return session.desk.now_ns >= stop_ns ? how : StopRequest::none; });
}

TEST(Acquisition, AStopAroundTheEndOfARunHarmsNothing) {
  SessionOnDesk undisturbed(short_session);
  uint64_t rest_ns = 0;
  undisturbed.clock.each_turn = [&] {
    const bool moved = undisturbed.instrument.readings > 100;
    if (rest_ns == 0 && moved && undisturbed.client.last_known().state == wire::State::homed)
      rest_ns = undisturbed.desk.now_ns;
  };
  undisturbed.run();
  for (const StopRequest how : {StopRequest::at_cycle_end, StopRequest::now}) {
    for (const int64_t from_end_ms : {-20, -10, -6, -4, -3, -2, -1, 0, 1, 2, 4, 10, 100, 200}) {
      SCOPED_TRACE(from_end_ms);
      SessionOnDesk session(short_session);
      stop_at(session, rest_ns + static_cast<uint64_t>(1'000'000 * from_end_ms), how);
      EXPECT_TRUE(session.outcome.regular()) << session.outcome.end;
      if (from_end_ms >= 0) {
        EXPECT_EQ(session.outcome.end, "completed");
      }
      EXPECT_EQ(std::ranges::count(session.remarks, "error", &RunRemark::level), 0);
      EXPECT_GE(std::ranges::count(session.remarks, "stop", &RunRemark::code), 1) << "the order is kept";
      EXPECT_THAT(runfile::assess(session.assemble().run).problems, testing::IsEmpty());
    }
  }
}

TEST(Acquisition, AnUnpluggedLineEndsTheRunAndSaysSo) {
  SessionOnDesk session(short_session);
  session.clock.each_turn = [&] {
    if (session.instrument.readings > 200) session.desk.plugged = false;
  };
  session.run();
  EXPECT_EQ(session.outcome.end, "link_lost");
  EXPECT_FALSE(session.outcome.regular());
  const AssembledRun assembled = session.assemble();
  expect_books_balance(assembled);
  EXPECT_FALSE(assembled.ended_in_order);
  EXPECT_FALSE(runfile::assess(assembled.run).sound());
}

TEST(Acquisition, ALineThatIsUnpluggedBeforeTheStartLeavesNoRunAndTheReason) {
  SessionOnDesk session(short_session);
  session.run([&] {
    session.desk.plugged = false;
    return StopRequest::none;
  });
  EXPECT_EQ(session.outcome.end, "link_lost");
  EXPECT_THAT(session.outcome.first_error, testing::HasSubstr("the pump stops by itself"));
  EXPECT_THROW((void)session.assemble(), NothingRecorded);
}

TEST(Acquisition, ADiskThatFailsToFlushEndsTheRunAsJournalFailed) {
  SessionOnDesk session(short_session);
  session.flush = [](int) {
    errno = EIO;
    return -1;
  };
  session.run();
  EXPECT_EQ(session.outcome.end, "journal_failed");
  EXPECT_FALSE(session.outcome.regular());
  ASSERT_FALSE(session.remarks.empty());
  EXPECT_EQ(session.remarks.back().code, "journal_failed");
  EXPECT_THAT(session.remarks.back().text, testing::HasSubstr("cannot be brought to the disk"));
}

TEST(Acquisition, AnEmergencyStopIsToldInPlainWords) {
  SessionOnDesk session(short_session);
  session.clock.each_turn = [&] {
    if (session.instrument.readings == 250) session.desk.controller->set_estop(true);
  };
  session.run();
  EXPECT_EQ(session.outcome.end, "faulted");
  ASSERT_FALSE(session.remarks.empty());
  EXPECT_THAT(session.remarks[0].text, testing::HasSubstr("emergency stop"));
  expect_books_balance(session.assemble());
}

TEST(Acquisition, TwoEqualSessionsWriteEqualJournals) {
  const auto bytes = [] {
    SessionOnDesk session(short_session);
    session.run();
    return session.assemble().run.pressure;
  };
  const runfile::PressureTrace first = bytes();
  const runfile::PressureTrace second = bytes();
  EXPECT_EQ(first.time_s, second.time_s);
  EXPECT_EQ(first.channels, second.channels);
}

/// Sees the two TTLs of the short session, or as many more or fewer as it is told.
class DeskGate final : public GateInputs {
 public:
  DeskGate(SessionOnDesk& session, int error) : session_(session), error_(error) {}
  [[nodiscard]] std::string describe() const override { return "desk gate"; }
  [[nodiscard]] bool counts_pulses() const override { return true; }
  [[nodiscard]] bool sees_estop() const override { return true; }
  [[nodiscard]] bool estop_pressed() const override { return false; }
  GateReading take() override {
    GateReading reading;
    const int cycles = session_.instrument.readings > 300 ? 2 + error_ : 0;
    for (; seen_ < cycles; ++seen_)
      reading.note_pulse(session_.desk.now_ns);
    return reading;
  }

 private:
  SessionOnDesk& session_;
  int error_;
  int seen_ = 0;
};

class GateAgainstController : public testing::TestWithParam<int> {};

TEST_P(GateAgainstController, ADisagreementAtTheEndIsAnErrorInTheRunFile) {
  SessionOnDesk session(short_session);
  DeskGate gate(session, GetParam());
  session.gate = &gate;
  session.run();
  EXPECT_EQ(session.outcome.end, "completed");
  const RecordedRun run = session.assemble().run;
  const auto reported = [&run](const std::string& level) {
    return std::count_if(run.events.begin(), run.events.end(), [&](const runfile::Event& event) {
      return event.level == level && event.code == "gate_count" && event.time_s > 1.8;
    });
  };
  EXPECT_EQ(reported("error"), GetParam() == 0 ? 0 : 1);
  EXPECT_EQ(reported("info"), GetParam() == 0 ? 1 : 0);
}

INSTANTIATE_TEST_SUITE_P(Acquisition, GateAgainstController, testing::Values(-1, 0, 1));

/// Sees the emergency stop pressed, which the controller does not, some moments before the end of the run.
class LateEstop final : public GateInputs {
 public:
  explicit LateEstop(SessionOnDesk& session) : session_(session) {}
  [[nodiscard]] std::string describe() const override { return "desk inputs"; }
  [[nodiscard]] bool counts_pulses() const override { return false; }
  [[nodiscard]] bool sees_estop() const override { return true; }
  [[nodiscard]] bool estop_pressed() const override { return false; }
  GateReading take() override {
    GateReading reading;
    if (session_.instrument.readings > 570 && !std::exchange(pressed_, true))
      reading.note_estop({session_.desk.now_ns, true, true});
    return reading;
  }

 private:
  SessionOnDesk& session_;
  bool pressed_ = false;
};

TEST(Acquisition, AnEmergencyStopJustBeforeTheEndIsStillHeldAgainstTheController) {
  SessionOnDesk session(short_session);
  LateEstop inputs(session);
  session.gate = &inputs;
  session.run();
  EXPECT_EQ(session.outcome.end, "completed");
  const RecordedRun run = session.assemble().run;
  EXPECT_TRUE(std::ranges::any_of(run.events, [](const runfile::Event& event) {
    return event.level == "error" && event.code == "estop_unseen";
  }));
}

}  // namespace
}  // namespace diastole
