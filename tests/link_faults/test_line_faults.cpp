#include "tests/link_faults/line_faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace diastole::link_faults {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Frame `number`: eight bytes that tell it, and a 0x00.
Bytes frame(std::uint8_t number) {
  Bytes bytes(9, static_cast<std::uint8_t>(number + 1));
  bytes.back() = 0;
  return bytes;
}

Bytes after(LineFaults& line, std::uint8_t frames) {
  for (std::uint8_t i = 0; i < frames; ++i)
    line.push(frame(i), 0);
  return line.take(LineFaults::kTimeout_us);
}

TEST(LineFaults, AGoodLineChangesNothing) {
  LineFaults line({}, 1);
  Bytes sent;
  for (std::uint8_t i = 0; i < 50; ++i) {
    const Bytes one = frame(i);
    sent.insert(sent.end(), one.begin(), one.end());
  }
  EXPECT_EQ(after(line, 50), sent);
  EXPECT_EQ(line.counts().damaged, 0U);
}

TEST(LineFaults, WhatHasNoEndTravelsOnAfterAWhile) {
  LineFaults line({}, 1);
  line.push(Bytes{1, 2, 3}, 0);
  EXPECT_TRUE(line.take(LineFaults::kTimeout_us - 1).empty());
  EXPECT_EQ(line.next_due_us(), LineFaults::kTimeout_us);
  EXPECT_EQ(line.take(LineFaults::kTimeout_us), (Bytes{1, 2, 3}));
  EXPECT_FALSE(line.next_due_us());
}

TEST(LineFaults, EachFaultIsMadeAtItsRateAndCounted) {
  const auto size_after = [](FaultRates rates, FaultCounts& counts) {
    LineFaults line(rates, 7);
    std::size_t size = 0;
    for (int i = 0; i < 200; ++i)
      size += after(line, 50).size();
    counts = line.counts();
    return size;
  };
  constexpr std::size_t kWhole = 200 * 50 * 9;
  FaultCounts counts;
  std::size_t size = 0;
  EXPECT_EQ(size_after({.bit_error = 1e-3}, counts), kWhole);
  EXPECT_NEAR(static_cast<double>(counts.bits_flipped), kWhole * 8e-3, 90);
  EXPECT_LE(counts.damaged, counts.bits_flipped);
  size = size_after({.byte_loss = 1e-2}, counts);
  EXPECT_EQ(size, kWhole - counts.bytes_lost);
  EXPECT_NEAR(static_cast<double>(counts.bytes_lost), kWhole * 1e-2, 100);
  size = size_after({.frame_loss = 1e-2}, counts);
  EXPECT_EQ(size, kWhole - 9 * counts.lost);
  EXPECT_NEAR(static_cast<double>(counts.lost), 100, 40);
  size = size_after({.repetition = 1e-2}, counts);
  EXPECT_EQ(size, kWhole + 9 * counts.repeated);
  EXPECT_NEAR(static_cast<double>(counts.repeated), 100, 40);
  EXPECT_LT(size_after({.truncation = 1e-2}, counts), kWhole);
  EXPECT_NEAR(static_cast<double>(counts.truncated), 100, 40);
  EXPECT_EQ(size_after({.reordering = 1e-2}, counts), kWhole);
  EXPECT_NEAR(static_cast<double>(counts.reordered), 100, 40);
}

TEST(LineFaults, OvertakenFramesComeAtMostThreeLater) {
  LineFaults line({.reordering = 0.2}, 5);
  const Bytes through = after(line, 100);
  ASSERT_EQ(through.size(), 900U);
  bool moved = false;
  for (std::size_t at = 0; at < 100; ++at) {
    const int number = through[9 * at] - 1;
    moved = moved || number != static_cast<int>(at);
    EXPECT_LE(static_cast<int>(at) - number, 6) << "overtaken by more than three and their own delays";
  }
  EXPECT_TRUE(moved);
}

TEST(LineFaults, DelayHoldsEachFrameBackInOrder) {
  LineFaults line({.delay_us = 5'000, .jitter_us = 1'000}, 1);
  line.push(frame(0), 0);
  line.push(frame(1), 100);
  EXPECT_TRUE(line.take(4'999).empty());
  const Bytes through = line.take(6'100);
  ASSERT_EQ(through.size(), 18U);
  EXPECT_TRUE(std::is_sorted(through.begin(), through.begin() + 8));
  EXPECT_EQ(through[0], 1);
}

TEST(LineFaults, PiecesDoNotMatter) {
  LineFaults whole({.bit_error = 1e-2, .repetition = 0.1, .reordering = 0.1}, 3);
  LineFaults pieces({.bit_error = 1e-2, .repetition = 0.1, .reordering = 0.1}, 3);
  for (std::uint8_t i = 0; i < 60; ++i) {
    whole.push(frame(i), 0);
    for (const std::uint8_t byte : frame(i))
      pieces.push({&byte, 1}, 0);
  }
  EXPECT_EQ(whole.take(1'000'000), pieces.take(1'000'000));
}

}  // namespace
}  // namespace diastole::link_faults
