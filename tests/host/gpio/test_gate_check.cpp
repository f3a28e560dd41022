#include "host/gpio/gate_check.hpp"

#include <gmock/gmock.h>

namespace diastole {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr uint64_t ms = 1'000'000;

class Inputs final : public GateInputs {
 public:
  [[nodiscard]] std::string describe() const override { return "inputs"; }
  [[nodiscard]] bool counts_pulses() const override { return gate; }
  [[nodiscard]] bool sees_estop() const override { return true; }
  [[nodiscard]] bool estop_pressed() const override { return pressed; }
  GateReading take() override { return std::exchange(next, {}); }
  void pulse(int count) { next.pulses += static_cast<uint64_t>(count); }

  GateReading next;
  bool gate = true;
  bool pressed = false;
};

TEST(GateReading, ALineThatChattersForDaysIsCountedAndFillsNoMemory) {
  GateReading reading;
  for (uint64_t i = 0; i < 100'000; ++i) {
    reading.note_pulse(i);
    reading.note_estop({i, i % 2 == 0, true});
  }
  EXPECT_EQ(reading.pulses, 100'000U);
  EXPECT_THAT(reading.pulse_ns, SizeIs(GateReading::most_kept));
  EXPECT_EQ(reading.pulse_ns.back(), GateReading::most_kept - 1);
  EXPECT_THAT(reading.estop_changes, SizeIs(GateReading::most_kept));
  EXPECT_EQ(reading.estop_changes.back().host_ns, 99'999U) << "what the line shows now";
}

TEST(GateCheck, EqualCountsAreSaidAtTheEnd) {
  Inputs inputs;
  inputs.pulse(7);  // before the run
  GateCheck check(inputs);
  for (uint64_t cycle = 1; cycle <= 5; ++cycle) {
    inputs.pulse(1);
    EXPECT_THAT(check.check(cycle * 1000 * ms, {cycle, false}), IsEmpty());
  }
  const auto remarks = check.close(6000 * ms, {5, false}, 5);
  ASSERT_THAT(remarks, SizeIs(1));
  EXPECT_EQ(remarks[0].level, "info");
  EXPECT_THAT(remarks[0].text, HasSubstr("5 pulses"));
}

TEST(GateCheck, AReportMayTakeAWhileButNotForever) {
  Inputs inputs;
  GateCheck check(inputs);
  inputs.pulse(1);
  EXPECT_THAT(check.check(1000 * ms, {0, false}), IsEmpty());
  EXPECT_THAT(check.check(1400 * ms, {0, false}), IsEmpty());
  EXPECT_THAT(check.check(1450 * ms, {1, false}), IsEmpty());
  inputs.pulse(2);  // one more than the controller knows of
  EXPECT_THAT(check.check(2000 * ms, {2, false}), IsEmpty());
  const auto remarks = check.check(2501 * ms, {2, false});
  ASSERT_THAT(remarks, SizeIs(1));
  EXPECT_EQ(remarks[0].level, "error");
  EXPECT_THAT(remarks[0].text, testing::AllOf(HasSubstr("3 pulses"), HasSubstr("2 triggers")));
  EXPECT_THAT(check.check(9000 * ms, {2, false}), IsEmpty()) << "said once";
}

TEST(GateCheck, AMissingPulseIsAnErrorAtTheEnd) {
  Inputs inputs;
  GateCheck check(inputs);
  inputs.pulse(4);
  inputs.next.may_have_lost = true;
  const auto remarks = check.close(1000 * ms, {5, false}, 5);
  ASSERT_THAT(remarks, SizeIs(1));
  EXPECT_EQ(remarks[0].level, "error");
  EXPECT_THAT(remarks[0].text,
              testing::AllOf(HasSubstr("4 pulses"), HasSubstr("5 triggers"), HasSubstr("faster")));
}

TEST(GateCheck, WithoutAGatingLineNothingIsCompared) {
  Inputs inputs;
  inputs.gate = false;
  GateCheck check(inputs);
  EXPECT_THAT(check.check(9000 * ms, {3, false}), IsEmpty());
  EXPECT_THAT(check.close(9000 * ms, {3, false}, 3), IsEmpty());
}

TEST(GateCheck, AnEmergencyStopThatTheControllerDoesNotSeeIsAnError) {
  Inputs inputs;
  GateCheck check(inputs);
  inputs.next.note_estop({1000 * ms, true, true});
  auto remarks = check.check(1001 * ms, {});
  ASSERT_THAT(remarks, SizeIs(1));
  EXPECT_EQ(remarks[0].level, "warning");
  EXPECT_EQ(remarks[0].host_ns, 1000 * ms) << "the kernel's time";
  remarks = check.check(1600 * ms, {});
  ASSERT_THAT(remarks, SizeIs(1));
  EXPECT_EQ(remarks[0].code, "estop_unseen");
}

TEST(GateCheck, AnEmergencyStopThatTheControllerReportsIsNoDisagreement) {
  Inputs inputs;
  GateCheck check(inputs);
  inputs.next.note_estop({1000 * ms, true, false});
  EXPECT_THAT(check.check(1001 * ms, {0, true}), SizeIs(1));
  EXPECT_THAT(check.check(3000 * ms, {0, true}), IsEmpty());
}

TEST(GateCheck, APressThatIsReleasedAtOnceIsStillToBeReported) {
  Inputs inputs;
  GateCheck check(inputs);
  inputs.next.note_estop({1000 * ms, true, true});
  inputs.next.note_estop({1020 * ms, false, true});
  EXPECT_THAT(check.check(1030 * ms, {}), SizeIs(2));
  EXPECT_TRUE(check.awaits_estop(1400 * ms, {}));
  EXPECT_FALSE(check.awaits_estop(1400 * ms, {0, true}));
  const auto remarks = check.check(1501 * ms, {});
  ASSERT_THAT(remarks, SizeIs(1));
  EXPECT_EQ(remarks[0].code, "estop_unseen");
  EXPECT_FALSE(check.awaits_estop(1502 * ms, {}));
}

TEST(GateCheck, AnEdgeThatComesDuringTheLookIsNotLate) {
  Inputs inputs;
  GateCheck check(inputs);
  inputs.next.note_estop({1001 * ms, true, true});
  EXPECT_THAT(check.check(1000 * ms, {}), SizeIs(1)) << "pressed, and nothing else";
}

TEST(GateCheck, ALineThatBouncesAtRestIsCountedAndSaidOnce) {
  Inputs inputs;
  GateCheck check(inputs);
  std::vector<GateRemark> remarks;
  uint64_t now_ns = 1000 * ms;
  for (int turn = 0; turn < 60'000;
       ++turn, now_ns += ms) {  // a minute, ten edges a millisecond, and no trigger
    for (uint64_t edge = 0; edge < 10; ++edge)
      inputs.next.note_pulse(now_ns + edge * ms / 10);
    for (const GateRemark& each : check.check(now_ns, {}))
      remarks.push_back(each);
  }
  for (const GateRemark& each : check.close(now_ns, {}, 0))
    remarks.push_back(each);
  ASSERT_THAT(remarks, SizeIs(2)) << "when it lasts, and at the end";
  EXPECT_EQ(check.pulses(), 600'000U);
  EXPECT_THAT(remarks[0].text, HasSubstr("the line bounces"));
  EXPECT_THAT(remarks[1].text,
              HasSubstr("showed 600000 pulses, the controller raised 0 triggers (599999 of"));
}

TEST(GateCheck, AnEmergencyStopLineThatChattersFillsNoJournal) {
  Inputs inputs;
  GateCheck check(inputs);
  size_t remarks = 0, estop_unseen = 0;
  std::string last;
  uint64_t now_ns = 1000 * ms;
  for (int turn = 0; turn < 60'000; ++turn, now_ns += ms) {
    for (uint64_t edge = 0; edge < 10; ++edge)
      inputs.next.note_estop({now_ns + edge, edge % 2 == 0, true});
    for (const GateRemark& each : check.check(now_ns, {0, true})) {
      ++remarks;
      estop_unseen += each.code == "estop_unseen" ? 1 : 0;
      last = each.text;
    }
  }
  EXPECT_LE(remarks, 60U * 9 + 9);
  EXPECT_GE(remarks, 60U * 9 - 9);
  EXPECT_EQ(estop_unseen, 0U);
  EXPECT_THAT(check.close(now_ns, {0, true}, 0).front().text, HasSubstr("the emergency stop line changed"));
}

TEST(GateCheck, LinesThatFailAreTold) {
  Inputs inputs;
  GateCheck check(inputs);
  inputs.next.problem = "gone";
  const auto remarks = check.check(1 * ms, {});
  ASSERT_THAT(remarks, SizeIs(1));
  EXPECT_EQ(remarks[0].level, "error");
}

}  // namespace
}  // namespace diastole
