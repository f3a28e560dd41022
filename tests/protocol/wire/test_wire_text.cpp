#include <gtest/gtest.h>

#include <set>
#include <string>

#include "protocol/wire/wire_text.hpp"

namespace diastole::wire {
namespace {

TEST(WireText, ListsAreNumberedFromZeroWithoutHoles) {
  int next = 0;
#define DIASTOLE_FAULT(number, name, explanation, remedy) EXPECT_EQ(number, next++) << #name;
#include "protocol/wire/fault_list.inc"
  EXPECT_EQ(next - 1, static_cast<int>(kLastFault));
  next = 0;
#define DIASTOLE_REFUSAL(number, name, explanation) EXPECT_EQ(number, next++) << #name;
#include "protocol/wire/refusal_list.inc"
  EXPECT_EQ(next - 1, static_cast<int>(kLastRefusal));
  next = 0;
#define DIASTOLE_LIMIT(number, name, unit) EXPECT_EQ(number, next++) << #name;
#include "protocol/wire/limit_list.inc"
  EXPECT_EQ(next - 1, static_cast<int>(kLastLimit));
  next = 0;
#define DIASTOLE_STATE(number, name) EXPECT_EQ(number, next++) << #name;
#include "protocol/wire/state_list.inc"
  EXPECT_EQ(next - 1, static_cast<int>(kLastState));
  next = 0;
#define DIASTOLE_WAVEFORM(number, name) EXPECT_EQ(number, next++) << #name;
#include "protocol/wire/waveform_list.inc"
  EXPECT_EQ(next - 1, static_cast<int>(kLastWaveform));
  next = 0;
#define DIASTOLE_RUN_END(number, name) EXPECT_EQ(number, next++) << #name;
#include "protocol/wire/run_end_list.inc"
  EXPECT_EQ(next - 1, static_cast<int>(kLastRunEnd));
}

TEST(WireText, EveryFaultIsExplainedWithARemedy) {
  std::set<std::string> explanations;
  for (int number = 0; number <= static_cast<int>(kLastFault); ++number) {
    const auto fault = static_cast<Fault>(number);
    EXPECT_GT(fault_explanation(fault).size(), 5U);
    EXPECT_GT(fault_remedy(fault).size(), 5U);
    const bool clears = fault_remedy(fault).find("`diastole clear-fault`") != std::string_view::npos;
    // The crystal is looked at once, when the controller starts.
    EXPECT_EQ(clears, fault != Fault::none && fault != Fault::clock) << fault_name(fault);
    explanations.emplace(fault_explanation(fault));
  }
  EXPECT_EQ(explanations.size(), static_cast<std::size_t>(kLastFault) + 1);
}

TEST(WireText, UnknownNumbersHaveWordsToo) {
  EXPECT_EQ(fault_name(static_cast<Fault>(200)), "unknown");
  EXPECT_EQ(limit_name(Limit::flow), "flow");
  EXPECT_EQ(state_name(State::faulted), "faulted");
}

}  // namespace
}  // namespace diastole::wire
