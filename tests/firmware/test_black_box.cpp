#include "firmware/core/black_box.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::BlackBoxEntry;
using wire::Noted;
using wire::ResetCause;

std::vector<BlackBoxEntry> all_of(const BlackBox& box) {
  std::vector<BlackBoxEntry> entries;
  for (BlackBoxEntry entry = box.first_from(0); entry.number != 0; entry = box.first_from(entry.number + 1))
    entries.push_back(entry);
  return entries;
}

TEST(BlackBox, KeepsTheLastEntriesOverAResetAndCountsStarts) {
  BlackBox::Memory memory{};
  {
    BlackBox box(memory);
    box.begin(ResetCause::power_on, 7, Ticks{10});
    for (int i = 0; i < 400; ++i)
      box.note(Noted::refusal, 4, i, Ticks{100 + i});
  }
  BlackBox box(memory);
  box.begin(ResetCause::watchdog, 8, Ticks{3});
  const auto entries = all_of(box);
  ASSERT_EQ(entries.size(), BlackBox::kEntries);
  EXPECT_EQ(entries.back(), (BlackBoxEntry{402, 2, Noted::started, 4, 3, 8}));
  EXPECT_EQ(entries[BlackBox::kEntries - 2], (BlackBoxEntry{401, 1, Noted::refusal, 4, 499, 399}));
}

TEST(BlackBox, IsEmptyAfterPowerOnWhateverStoodThere) {
  BlackBox::Memory memory{};
  BlackBox(memory).begin(ResetCause::software, 1, Ticks{0});
  BlackBox box(memory);
  box.begin(ResetCause::power_on, 2, Ticks{0});
  ASSERT_EQ(all_of(box).size(), 1U);
  EXPECT_EQ(all_of(box)[0], (BlackBoxEntry{1, 1, Noted::started, 1, 0, 2}));
}

TEST(BlackBox, NeverBelievesArbitraryMemoryNorAnEntryThatWasBeingWritten) {
  std::mt19937 random(3);
  BlackBox::Memory memory{};
  for (auto& slot : memory)
    for (auto& byte : slot)
      byte = static_cast<std::uint8_t>(random());
  BlackBox box(memory);
  box.begin(ResetCause::unknown, 2, Ticks{0});
  EXPECT_EQ(all_of(box).size(), 1U);
  for (int i = 0; i < 10; ++i)
    box.note(Noted::state, static_cast<std::uint8_t>(i % 2), i, Ticks{i});
  memory[5][12] = static_cast<std::uint8_t>(memory[5][12] ^ 1U);
  BlackBox again(memory);
  again.begin(ResetCause::watchdog, 3, Ticks{0});
  const auto entries = all_of(again);
  ASSERT_EQ(entries.size(), 11U);
  for (const BlackBoxEntry& entry : entries)
    EXPECT_NE(entry.number, 5U);
}

TEST(BlackBox, TellsOverTheWireWhatHappenedBeforeAReset) {
  RecordedController::Options options;
  {
    Bench bench(options);
    bench.prepare();
    bench.rig.set_estop(true);
    bench.run_for(microseconds(100'000));
    EXPECT_FALSE(bench.ask(wire::ClearFault{}));
  }
  options.board.identity = {1, 0xB008, ResetCause::watchdog};
  Bench bench(options);
  bench.connect();
  std::vector<BlackBoxEntry> reported;
  for (std::uint32_t from = 0;; from = reported.back().number + 1) {
    const std::size_t before = bench.heard.black_box.size();
    bench.request(wire::ReadBlackBox{0, from});
    ASSERT_TRUE(
        bench.run_until([&] { return bench.heard.black_box.size() > before; }, microseconds(500'000)));
    if (bench.heard.black_box.back().entry.number == 0) break;
    reported.push_back(bench.heard.black_box.back().entry);
  }
  const auto has = [&](std::uint16_t boot, Noted kind, std::uint8_t detail) {
    return std::ranges::any_of(reported, [&](const BlackBoxEntry& entry) {
      return entry.boot == boot && entry.kind == kind && entry.detail == detail;
    });
  };
  EXPECT_TRUE(has(1, Noted::started, static_cast<std::uint8_t>(ResetCause::power_on)));
  EXPECT_TRUE(has(1, Noted::link, 1));
  EXPECT_TRUE(has(1, Noted::state, static_cast<std::uint8_t>(wire::State::homing)));
  EXPECT_TRUE(has(1, Noted::state, static_cast<std::uint8_t>(wire::State::homed)));
  EXPECT_TRUE(has(1, Noted::estop, 1));
  EXPECT_TRUE(has(1, Noted::fault, static_cast<std::uint8_t>(wire::Fault::estop)));
  EXPECT_TRUE(has(1, Noted::refusal, static_cast<std::uint8_t>(wire::Refusal::estop_pressed)));
  EXPECT_TRUE(has(2, Noted::started, static_cast<std::uint8_t>(ResetCause::watchdog)));
  EXPECT_EQ(reported.back().boot, 2);
}

TEST(BlackBox, NotesAHostThatFallsSilent) {
  Bench bench;
  bench.connect();
  bench.cable = false;
  bench.run_for(microseconds(1'500'000));
  bench.cable = true;
  bench.connect();
  bench.request(wire::ReadBlackBox{0, 0});
  bench.run_for(microseconds(100'000));
  ASSERT_FALSE(bench.heard.black_box.empty());
  EXPECT_EQ(bench.heard.black_box.back().newest, 4U) << "started, opened, lost, opened";
}

TEST(BlackBox, TellsTheRegistersOfACrashOnceBehindTheStart) {
  RecordedController::Options options;
  options.board.identity.reset_cause = ResetCause::watchdog;
  CrashRecord crash;
  for (std::size_t i = 0; i < crash.values.size(); ++i)
    crash.values[i] = 0x8000'0000U + static_cast<std::uint32_t>(i);
  options.board.memory->crash = crash;
  Bench bench(options);
  bench.connect();
  const auto reported = [&bench] {
    std::vector<BlackBoxEntry> entries;
    for (std::uint32_t from = 1;; from = entries.back().number + 1) {
      const std::size_t before = bench.heard.black_box.size();
      bench.request(wire::ReadBlackBox{0, from});
      bench.run_until([&] { return bench.heard.black_box.size() > before; }, microseconds(3'000'000));
      if (bench.heard.black_box.back().entry.number == 0) return entries;
      entries.push_back(bench.heard.black_box.back().entry);
    }
  };
  const auto entries = reported();
  ASSERT_GT(entries.size(), wire::kCrashRegisters);
  EXPECT_EQ(entries[0].kind, Noted::started);
  for (std::size_t i = 0; i < wire::kCrashRegisters; ++i) {
    EXPECT_EQ(entries[1 + i].kind, Noted::crash);
    EXPECT_EQ(entries[1 + i].detail, i);
    EXPECT_EQ(static_cast<std::uint32_t>(entries[1 + i].argument), crash.values[i]);
  }
  EXPECT_FALSE(options.board.memory->crash.has_value()) << "it is told once";
}

}  // namespace
}  // namespace diastole::firmware
