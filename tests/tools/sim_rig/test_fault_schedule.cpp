#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/contract/input_error.hpp"
#include "protocol/wire/messages.hpp"
#include "tools/sim_rig/timeline.hpp"

namespace diastole::sim_rig {
namespace {

using testing::HasSubstr;

TEST(FaultSchedule, TellsWhatIsSwitchedWhen) {
  const auto switches = parse_faults(
      {"serial-hangup@3.5", "daq-stall@ttl+2+0.05", "daq-delay@1+2/0.5", "leak@12.5s/3:off@run+20s"});
  ASSERT_EQ(switches.size(), 7U);
  EXPECT_EQ(switches[0].kind->name, "serial-hangup");
  EXPECT_EQ(switches[0].when.after_ns, 3'500'000'000U);
  EXPECT_TRUE(switches[0].value);
  EXPECT_EQ(switches[2].when.origin, Origin::ttl);
  EXPECT_EQ(switches[2].when.after_ns, 2'050'000'000U);
  EXPECT_FALSE(switches[2].value);
  EXPECT_EQ(switches[3].value, 0.5);
  EXPECT_EQ(switches[5].value, 3);
  EXPECT_EQ(switches[6].when.origin, Origin::run);
  EXPECT_EQ(switches[6].when.after_ns, 20'000'000'000U);
}

TEST(FaultSchedule, AnythingElseIsRefusedWithTheForms) {
  for (const char* text : {"serial-hangup", "daq-drop@x+1", "daq-stall@2+-1", "daq-stall@2+1m", "leak@2:on@3",
                           "leak@2/x", "leak@2+1:off@4", "leak@-1", "leak@1e10", "leak@nan"}) {
    try {
      parse_faults({text});
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(HasSubstr(text), HasSubstr("NAME@T+LENGTH")));
    }
  }
  EXPECT_THROW(parse_faults({"fire@3"}), InputError);
  EXPECT_THROW(parse_faults({"estop@3/2"}), InputError);
  EXPECT_THROW(parse_faults({"step-loss@3/2"}), InputError);
}

/// The bytes by which the controller tells a message.
template <class Message>
std::vector<uint8_t> framed(const Message& message) {
  std::array<uint8_t, wire::kMaxPayloadBytes> payload{};
  std::array<uint8_t, wire::kMaxEncodedBytes> memory{};
  const wire::FrameHeader header{7, wire::FrameKind::sequenced, static_cast<uint8_t>(Message::kType), 0, 0};
  const auto frame = wire::encode_frame(header, wire::encode(message, payload), memory);
  return {frame.begin(), frame.end()};
}

TEST(RunClock, KnowsTheStartOfRunAheadAndThenToTheTick) {
  RunClock clock;
  EXPECT_FALSE(clock.run_start_ns());
  wire::StateChanged changed;
  changed.to = wire::State::running;
  changed.tick = 84'000'000;
  clock.observe(framed(changed), 5'000);
  EXPECT_EQ(clock.run_start_ns(), 1'020'005'000U);
  wire::RunStarted started;
  started.tick = 84'000'000 + 20'000 * 84 + 1;
  clock.observe(framed(started), 5'000);
  EXPECT_EQ(clock.run_start_ns(), 1'020'005'012U) << "the first ns within the tick";
  EXPECT_EQ(clock.at_ns({Origin::run, 24}), 1'020'005'036U) << "three ticks later";
  EXPECT_FALSE(clock.at_ns({Origin::ttl, 0}));
  EXPECT_EQ(clock.present_or_next_run(), 1U);
  EXPECT_FALSE(clock.at_ns({Origin::run, 24, 2}));
  clock.trigger(2'000'000'000);
  clock.trigger(3'000'000'000);
  EXPECT_EQ(clock.at_ns({Origin::ttl, 5}), 2'000'000'005U);
  changed.to = wire::State::homed;
  clock.observe(framed(changed), 5'000);
  EXPECT_EQ(clock.run_start_ns(), 1'020'005'012U) << "of the latest run";
  EXPECT_EQ(clock.present_or_next_run(), 2U);
  changed.to = wire::State::running;
  changed.tick *= 2;
  clock.observe(framed(changed), 5'000);
  EXPECT_EQ(clock.at_ns({Origin::run, 0, 2}), 2'020'005'000U);
  EXPECT_EQ(clock.at_ns({Origin::run, 0, 1}), 0U) << "long past";
}

TEST(Timeline, GivesWhatIsDueInOrder) {
  Timeline timeline;
  RunClock clock;
  timeline.plan(parse_faults({"leak@ttl+1", "estop@2+1", "daq-stuck@2"}));
  EXPECT_FALSE(timeline.take_switch(clock, 1'999'999'999));
  EXPECT_EQ(timeline.take_switch(clock, 9'000'000'000)->what.kind->name, "estop");
  EXPECT_EQ(timeline.take_switch(clock, 9'000'000'000)->what.kind->name, "daq-stuck");
  EXPECT_TRUE(timeline.awaits_origin(clock));
  clock.trigger(1'500'000'000);
  const auto leak = timeline.take_switch(clock, 9'000'000'000);
  EXPECT_EQ(leak->what.kind->name, "leak");
  EXPECT_EQ(leak->time_ns, 2'500'000'000U);
  EXPECT_FALSE(timeline.awaits_origin(clock));
  EXPECT_EQ(timeline.take_switch(clock, 9'000'000'000)->what.value, std::nullopt);
  EXPECT_FALSE(timeline.take_switch(clock, 9'000'000'000));
}

}  // namespace
}  // namespace diastole::sim_rig
