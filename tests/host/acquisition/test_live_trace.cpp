// What an onlooker sees of a run, against the run file of the same session.

#include "host/acquisition/live_trace.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/host/acquisition/session_on_desk.hpp"

namespace diastole {
namespace {

constexpr double tick_rate_Hz = 1e6;
constexpr uint64_t ms = 1'000'000;

/// Run "a", started at tick 5000, which was at 20 ms of the host's clock.
void start(LiveTrace& trace, double sample_rate_Hz) {
  trace.begin("a", sample_rate_Hz, tick_rate_Hz);
  trace.clock({.host_ns = 30 * ms, .tick = 15'000});
  trace.run_started(5'000);
}

TEST(LiveTrace, RowsAndTriggersAreOnTheControllersClockAndNumbered) {
  LiveTrace trace;
  trace.begin("a", 300, tick_rate_Hz);
  trace.sample(10 * ms, 1, 1.5);
  EXPECT_TRUE(trace.since("a", 0, 0).rows.empty()) << "the start is not known yet";
  trace.clock({.host_ns = 30 * ms, .tick = 15'000});
  trace.run_started(5'000);
  trace.sample(25 * ms, 2, 2.5);
  trace.trigger(6'000);
  const LiveTrace::Excerpt all = trace.since("a", 0, 0);
  ASSERT_EQ(all.rows.size(), 2U);
  EXPECT_DOUBLE_EQ(all.rows[0].time_s, -0.010);
  EXPECT_DOUBLE_EQ(all.rows[1].time_s, 0.005);
  EXPECT_EQ(all.rows[1].filtered_kPa, 2.5);
  EXPECT_THAT(all.trigger_s, testing::ElementsAre(0.001));
  const LiveTrace::Excerpt rest = trace.since("a", 1, 1);
  EXPECT_EQ(rest.first_row, 1U);
  EXPECT_EQ(rest.rows.size(), 1U);
  EXPECT_TRUE(rest.trigger_s.empty());
  EXPECT_EQ(trace.since("of another run", 1, 1).rows.size(), 2U) << "from the beginning";
  EXPECT_TRUE(trace.since("a", 1'000'000, 1'000'000).rows.empty());
}

TEST(LiveTrace, AFastStreamIsThinnedAndKeepsItsPeaks) {
  LiveTrace trace;
  start(trace, 10'000);
  for (int i = 0; i < 10'000; ++i)
    trace.sample(20 * ms + static_cast<uint64_t>(i) * ms / 10, i == 4321 ? 99 : i % 2, 0);
  const auto rows = trace.since("a", 0, 0).rows;
  EXPECT_LE(static_cast<double>(rows.size()), LiveTrace::most_rows_a_second);
  EXPECT_GE(static_cast<double>(rows.size()), 0.9 * LiveTrace::most_rows_a_second);
  EXPECT_EQ(std::count_if(rows.begin(), rows.end(), [](const auto& row) { return row.kPa == 99; }), 1);
  for (size_t i = 1; i < rows.size(); ++i)
    EXPECT_LT(rows[i - 1].time_s, rows[i].time_s);
}

TEST(LiveTrace, OnlyTheNewestIsKeptAndAGapIsAHole) {
  LiveTrace trace;
  start(trace, 300);
  for (uint64_t i = 0; i < LiveTrace::most_rows + 10; ++i)
    trace.sample(i * ms, static_cast<double>(i), 0);
  const LiveTrace::Excerpt oldest = trace.since("a", 0, 0);
  EXPECT_EQ(oldest.first_row, 10U);
  EXPECT_EQ(oldest.rows.front().kPa, 10);
  EXPECT_EQ(oldest.rows.size(), LiveTrace::rows_at_once);
  trace.gap();
  trace.gap();
  trace.sample(60'000 * ms, 7, 7);
  const auto rows = trace.since("a", LiveTrace::most_rows + 9, 0).rows;
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_TRUE(std::isnan(rows[1].kPa));
  EXPECT_EQ(rows[2].kPa, 7);
}

TEST(LiveTrace, WhatAnOnlookerSeesIsWhatTheRunFileHolds) {
  SessionOnDesk session(short_session);
  LiveTrace trace;
  session.live = &trace;
  session.run();
  const runfile::RecordedRun run = session.assemble().run;
  LiveTrace::Excerpt seen = trace.since("desk", 0, 0);
  std::erase_if(seen.rows, [](const auto& row) { return row.time_s < 0; });  // as the file does
  ASSERT_EQ(seen.rows.size(), run.pressure.time_s.size());
  for (size_t i = 0; i < seen.rows.size(); ++i) {
    EXPECT_NEAR(seen.rows[i].time_s, run.pressure.time_s[i], 1e-3);
    EXPECT_EQ(seen.rows[i].kPa, run.pressure.channels.at("cavity_kPa")[i]);
  }
  ASSERT_EQ(seen.trigger_s.size(), run.trigger_s.size());
  EXPECT_NEAR(seen.trigger_s[1], run.trigger_s[1], 1e-6);
}

}  // namespace
}  // namespace diastole
