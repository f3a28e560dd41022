#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::State;
using wire::Waveform;

TEST(Run, TenParabolicCyclesOverTheRealProtocol) {
  Bench bench;
  bench.prepare();
  ASSERT_EQ(bench.state(), State::homed);
  EXPECT_EQ(bench.rig.position_microsteps(), 0);
  bench.add_segment(Waveform::parabolic, 10, 40'000'000, 1'200'000);
  bench.run_program();

  ASSERT_EQ(bench.heard.started.size(), 1U);
  ASSERT_EQ(bench.heard.ended.size(), 1U);
  const wire::RunStarted& started = bench.heard.started[0];
  const wire::RunEnded& ended = bench.heard.ended[0];
  EXPECT_EQ(started.cycles, 10U);
  EXPECT_EQ(ended.reason, wire::RunEnd::completed);
  EXPECT_EQ(ended.cycles, 10U);
  EXPECT_EQ(ended.triggers, 10U);
  EXPECT_EQ(ended.r_waves, 10U);
  EXPECT_EQ(ended.position_microsteps, 0);
  EXPECT_EQ(ended.tick - started.tick, 13'000'000U * 84);
  EXPECT_EQ(bench.state(), State::homed);

  ASSERT_EQ(bench.heard.triggers.size(), 10U);
  for (std::size_t i = 1; i < 10; ++i)
    EXPECT_EQ(bench.heard.triggers[i].tick - bench.heard.triggers[i - 1].tick, 1'200'000U * 84);

  // 13 s at 300 Hz, both ends included.
  EXPECT_TRUE(bench.heard.positions_contiguous);
  ASSERT_EQ(bench.heard.positions.size(), 3901U);
  EXPECT_EQ(bench.heard.position_ticks[0], started.tick);
  EXPECT_EQ(*std::max_element(bench.heard.positions.begin(), bench.heard.positions.end()), 5134);
  EXPECT_EQ(*std::min_element(bench.heard.positions.begin(), bench.heard.positions.end()), 0);
  EXPECT_EQ(bench.heard.undecodable, 0U);
}

}  // namespace
}  // namespace diastole::firmware
