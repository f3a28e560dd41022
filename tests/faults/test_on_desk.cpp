// Faults of line, controller, instrument, inputs and disk, in virtual time: firmware, client, acquisition and journal in
// one process.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <optional>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/faults/fault_table.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"
#include "tests/link_faults/campaign.hpp"

namespace diastole::faults {
namespace {

constexpr double ms_per_ns = 1e-6;
constexpr uint64_t lease_ns = 500'000'000;

/// Calls `act` once, when the run has gone on for `at_s`.
void once_at(SessionOnDesk& session, double at_s, const std::function<void()>& act) {
  const auto begun = std::make_shared<uint64_t>(0);
  const auto done = std::make_shared<bool>(false);
  session.clock.each_turn = [=, &session] {
    if (*done || session.instrument.readings == 0) return;
    if (*begun == 0) *begun = session.desk.now_ns;
    if (static_cast<double>(session.desk.now_ns - *begun) < 1e9 * at_s) return;
    *done = true;
    act();
  };
}

bool books_balance(const AssembledRun& assembled) {
  runfile::check(assembled.run);
  return assembled.run.pressure.time_s.size() == assembled.samples_received + assembled.samples_missing &&
         assembled.run.missing("pressure") == static_cast<int64_t>(assembled.samples_missing);
}

/// As many rows as the run's length asks for, by the experiment alone: 0.1 s of rest, two cycles of 0.8 s and 0.25 s after
/// the last step, at 300 Hz, and the 20 ms of a reading that failed at the end.
bool as_long_as_asked(const AssembledRun& assembled) {
  const size_t rows = assembled.run.pressure.time_s.size();
  return rows >= 580 && rows <= 596;
}

/// Neither moves nor is about to, for two seconds.
bool stays_at_rest(SessionOnDesk& session) {
  const wire::Status before = session.client.status();
  const uint64_t until_ns = session.desk.now_ns + 2'000'000'000;
  while (session.desk.now_ns < until_ns) {
    session.client.service();
    session.clock.sleep_until_ns(session.desk.now_ns + 20'000'000, nullptr);
  }
  const wire::Status after = session.client.status();
  const bool moving = before.state == wire::State::running || before.state == wire::State::stopping;
  return !moving && after.position_microsteps == before.position_microsteps && after.steps == before.steps &&
         after.state == before.state;
}

/// As the daemon does: again and again.
void come_back(SessionOnDesk& session) {
  for (int attempt = 0; attempt < 20 && !session.client.connected(); ++attempt) {
    try {
      session.client.connect();
    } catch (const HardwareError&) {
      session.desk.advance_to(session.desk.now_ns + 100'000'000);
    }
  }
}

TEST(Faults, CableUnplugged) {
  double slowest_flag_ms = 0;
  double slowest_return_ms = 0;
  const int tried = trials(20, 200);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    SessionOnDesk session(short_session);
    uint64_t unplugged_ns = 0;
    once_at(session, between(random, 0.05, 1.6), [&] {
      session.desk.plugged = false;
      unplugged_ns = session.desk.now_ns;
    });
    session.run();
    if (session.outcome.end != "link_lost") return false;
    slowest_flag_ms =
        std::max(slowest_flag_ms, ms_per_ns * static_cast<double>(session.desk.now_ns - unplugged_ns));
    session.desk.advance_to(unplugged_ns + lease_ns);
    session.desk.plugged = true;
    const uint64_t plugged_ns = session.desk.now_ns;
    come_back(session);
    slowest_return_ms =
        std::max(slowest_return_ms, ms_per_ns * static_cast<double>(session.desk.now_ns - plugged_ns));
    const wire::State state = session.client.status().state;
    const bool place_known =
        session.client.status().fault == wire::Fault::lease_lost || state == wire::State::homed;
    return place_known && stays_at_rest(session) && books_balance(session.assemble());
  });
  EXPECT_LE(slowest_flag_ms, 1000);
  EXPECT_LE(slowest_return_ms, 2000);
  add_to_table({"cable unplugged", "random phases of a run", tried, survived,
                fmt::format("at rest in the lease; reported in {:.0f} ms, back in {:.0f} ms", slowest_flag_ms,
                            slowest_return_ms)});
}

TEST(Faults, CableBackBeforeTheLeaseEnds) {
  double slowest_rest_ms = 0;
  int found_running = 0;
  const int tried = trials(50, 500);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    SessionOnDesk session(short_session);
    once_at(session, between(random, 0.05, 1.2), [&] { session.desk.plugged = false; });
    session.run();
    if (session.outcome.end != "link_lost") return false;
    session.desk.advance_to(session.desk.now_ns + static_cast<uint64_t>(between(random, 0, 0.4e9)));
    session.desk.plugged = true;
    const uint64_t plugged_ns = session.desk.now_ns;
    come_back(session);
    slowest_rest_ms =
        std::max(slowest_rest_ms, ms_per_ns * static_cast<double>(session.desk.now_ns - plugged_ns));
    found_running += session.client.found_moving() ? 1 : 0;
    return session.client.connected() && stays_at_rest(session) && books_balance(session.assemble());
  });
  EXPECT_GT(found_running, tried / 2);
  add_to_table(
      {"cable back at once", "0 to 400 ms unplugged in a run", tried, survived,
       fmt::format("{} found moving; at rest {:.0f} ms after the return", found_running, slowest_rest_ms)});
}

TEST(Faults, ControllerReset) {
  double slowest_ms = 0;
  const int tried = trials(50, 500);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    SessionOnDesk session(short_session);
    uint64_t reset_ns = 0;
    once_at(session, between(random, 0.05, 1.6), [&] {
      session.desk.reset_controller();
      session.desk.controller_started_ns = reset_ns = session.desk.now_ns;
    });
    session.run();
    slowest_ms = std::max(slowest_ms, ms_per_ns * static_cast<double>(session.desk.now_ns - reset_ns));
    if (session.outcome.end != "link_lost") return false;
    session.client.connect();
    return session.client.status().state == wire::State::unhomed && stays_at_rest(session) &&
           books_balance(session.assemble());
  });
  EXPECT_LE(slowest_ms, 200);
  add_to_table({"controller reset", "random moments of a run", tried, survived,
                fmt::format("seen in {:.0f} ms at most; unhomed after it", slowest_ms)});
}

TEST(Faults, InstrumentStalls) {
  uint64_t most_missing = 0;
  const int tried = trials(40, 400);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    SessionOnDesk session(short_session);
    const double stall_s = std::exp(between(random, std::log(0.01), std::log(10.0)));
    const double from_s = between(random, 0, 1.5);
    bool stalled = false;
    uint64_t until_ns = 0;
    once_at(session, from_s, [&] {
      stalled = true;
      until_ns = session.desk.now_ns + static_cast<uint64_t>(1e9 * stall_s);
    });
    const auto stalls = [&] { return stalled && session.desk.now_ns < until_ns; };
    session.instrument.delay_ns = [&](uint64_t) { return stalls() ? uint64_t{20'000'000} : uint64_t{0}; };
    session.instrument.fault = [&](uint64_t) {
      return stalls() ? daq::Outcome{false, "no answer within 20 ms"} : daq::Outcome{};
    };
    session.run();
    const AssembledRun assembled = session.assemble();
    most_missing = std::max(most_missing, assembled.samples_missing);
    return session.outcome.end == "completed" && assembled.run.trigger_s.size() == 2 &&
           assembled.samples_missing > 0 && books_balance(assembled) && as_long_as_asked(assembled);
  });
  add_to_table({"instrument stalls", "10 ms to 10 s, at random moments", tried, survived,
                fmt::format("received + gaps = expected; {} samples at most", most_missing)});
}

/// A gating line that bounces from the beginning of time on, until some time into the run.
class BouncingGate final : public GateInputs {
 public:
  BouncingGate(SessionOnDesk& session, double pulses_a_second, double until_s)
      : session_(session), interval_ns_(1e9 / pulses_a_second), until_ns_(1e9 * until_s) {}
  [[nodiscard]] std::string describe() const override { return "gate that bounces"; }
  [[nodiscard]] bool counts_pulses() const override { return true; }
  [[nodiscard]] bool sees_estop() const override { return false; }
  [[nodiscard]] bool estop_pressed() const override { return false; }
  /// What came at rest is taken by the first call, when the run begins.
  GateReading take() override {
    const auto now_ns = static_cast<double>(session_.desk.now_ns);
    const bool first = !begun_ns_;
    if (first) begun_ns_ = now_ns;
    GateReading reading;
    for (; next_ns_ <= std::min(now_ns, *begun_ns_ + until_ns_); next_ns_ += interval_ns_)
      reading.note_pulse(static_cast<uint64_t>(next_ns_));
    if (first)
      at_rest = reading;
    else
      in_run += reading.pulses;
    return reading;
  }

  GateReading at_rest;
  uint64_t in_run = 0;

 private:
  SessionOnDesk& session_;
  double interval_ns_, until_ns_, next_ns_ = 0;
  std::optional<double> begun_ns_;
};

TEST(Faults, GateBounces) {
  constexpr size_t room_for_remarks = 1'000;  // bytes
  size_t quiet_bytes = 0, most_bytes = 0;
  {
    SessionOnDesk session(short_session);
    session.run();
    quiet_bytes = std::filesystem::file_size(session.journal);
  }
  uint64_t most_pulses = 0;
  const int tried = trials(20, 200);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    SessionOnDesk session(short_session);
    BouncingGate gate(session, std::exp(between(random, std::log(400), std::log(100'000))),
                      between(random, 0.02, 2.5));
    session.gate = &gate;
    session.run();
    most_pulses = std::max(most_pulses, gate.at_rest.pulses + gate.in_run);
    const AssembledRun assembled = session.assemble();
    const auto remarks = std::ranges::count_if(
        session.remarks, [](const RunRemark& remark) { return remark.code == "gate_count"; });
    const bool named = std::ranges::any_of(session.remarks, [](const RunRemark& remark) {
      return remark.level == "error" && remark.text.find("the line bounces") != std::string::npos;
    });
    const size_t bytes = std::filesystem::file_size(session.journal);
    most_bytes = std::max(most_bytes, bytes - std::min(bytes, quiet_bytes));
    return session.outcome.end == "completed" && named && remarks <= 2 &&
           gate.at_rest.pulse_ns.size() <= GateReading::most_kept &&
           session.outcome.counts.gate_pulses == gate.in_run && bytes <= quiet_bytes + room_for_remarks &&
           assembled.run.trigger_s.size() == 2 && assembled.samples_missing == 0 && books_balance(assembled);
  });
  add_to_table({"gate line bounces", "at rest and in a run, 400 to 100,000/s", tried, survived,
                fmt::format("counted, named in two remarks at most: {} pulses, {} more bytes of journal",
                            most_pulses, most_bytes)});
}

TEST(Faults, DiskFull) {
  size_t whole_bytes = 0;
  {
    SessionOnDesk session(short_session);
    session.run();
    whole_bytes = std::filesystem::file_size(session.journal);
  }
  uint64_t fewest = UINT64_MAX;
  const int tried = trials(60, 1000);
  const int survived = survivors(tried, [&](int, std::mt19937& random) {
    SessionOnDesk session(short_session);
    auto room = static_cast<size_t>(between(random, 3000, static_cast<double>(whole_bytes)));
    session.write = [&room](int file, const void* bytes, size_t size) {
      const size_t accepted = std::min(room, size);
      room -= accepted;
      errno = ENOSPC;
      return accepted == 0 ? ssize_t{-1} : ::write(file, bytes, accepted);
    };
    session.run();
    const bool reported =
        std::any_of(session.remarks.begin(), session.remarks.end(),
                    [](const RunRemark& remark) { return remark.code == "journal_failed"; });
    if (session.outcome.end != "journal_failed" || !reported) return false;
    const wire::Status status = session.client.status();
    if (status.state != wire::State::homed && status.state != wire::State::armed) return false;
    const JournalContents journal = read_journal(session.journal);
    fewest = std::min<uint64_t>(fewest, journal.records.size());
    return journal.records_lost == 0 && stays_at_rest(session);
  });
  add_to_table({"disk full", "no room left at random offsets", tried, survived,
                fmt::format("journal readable to its last whole record ({} at least)", fewest)});
}

TEST(Faults, BadLine) {
  using link_faults::FaultRates;
  uint64_t frames = 0;
  uint64_t wrong = 0;
  const std::array<FaultRates, 6> lines{{{.bit_error = 1e-5},
                                         {.bit_error = 1e-4},
                                         {.bit_error = 1e-3, .byte_loss = 1e-3},
                                         {.bit_error = 1e-2},
                                         {.frame_loss = 0.05, .repetition = 0.05, .reordering = 0.05},
                                         {.truncation = 0.1}}};
  const int tried = static_cast<int>(lines.size());
  const int survived = survivors(tried, [&](int k, std::mt19937&) {
    const auto report = link_faults::run_campaign({.rates = lines.at(static_cast<size_t>(k)),
                                                   .frames = static_cast<uint64_t>(trials(3000, 170'000)),
                                                   .seed = static_cast<uint64_t>(k) + 1});
    frames += report.line.frames;
    wrong += report.wrong;
    return report.wrong == 0 && report.missing == 0;
  });
  add_to_table({"corrupted link", "damaged, lost, repeated, cut frames", tried, survived,
                fmt::format("{} wrong of {} frames", wrong, frames)});
}

}  // namespace
}  // namespace diastole::faults
