#include "host/acquisition/sample_source.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "host/acquisition/block_source.hpp"
#include "host/acquisition/polled_source.hpp"
#include "host/acquisition/threaded_source.hpp"

namespace diastole {
namespace {

constexpr uint64_t ns_per_ms = 1'000'000;
constexpr uint64_t ns_per_s = 1'000'000'000;

class StillClock final : public Clock {
 public:
  [[nodiscard]] uint64_t now_ns() override { return now; }
  void sleep_until_ns(uint64_t until_ns, ByteLine*) override { now = std::max(now, until_ns); }
  [[nodiscard]] bool stands_still() const override { return true; }
  uint64_t now = 5 * ns_per_s;
};

/// What a source gave; fails where an index is given twice, left out or out of order.
struct Books {
  uint64_t received = 0;
  uint64_t missing = 0;
  std::vector<std::string> reasons;
  std::vector<std::string> faults;
  std::vector<InstrumentTime> times;
  std::vector<double> volts;  // received ones, one channel

  void take(const std::vector<SourceItem>& items) {
    for (const SourceItem& item : items) {
      if (const auto* samples = std::get_if<Received>(&item)) {
        EXPECT_EQ(samples->first_index, received + missing);
        EXPECT_EQ(samples->volts.size(), samples->host_ns.size());
        received += samples->host_ns.size();
        volts.insert(volts.end(), samples->volts.begin(), samples->volts.end());
      } else if (const auto* gap = std::get_if<Missing>(&item)) {
        EXPECT_EQ(gap->first_index, received + missing);
        EXPECT_GT(gap->count, 0U);
        missing += gap->count;
        if (reasons.empty() || reasons.back() != gap->reason) reasons.push_back(gap->reason);
      } else if (const auto* time = std::get_if<InstrumentTime>(&item)) {
        times.push_back(*time);
      } else {
        faults.push_back(std::get<InstrumentFault>(item).text);
      }
    }
  }
};

void run_until(SampleSource& source, StillClock& clock, uint64_t end_ns, Books& books) {
  while (clock.now < end_ns || !source.complete(end_ns)) {
    books.take(source.take());
    clock.sleep_until_ns(std::max(source.next_due_ns(), clock.now + 1), nullptr);
  }
  books.take(source.finish(end_ns));
}

/// Samples by its own clock of the desk's time; volt = index. Blocks of 64.
class Blocks final : public daq::BlockInstrument {
 public:
  explicit Blocks(StillClock& clock) : clock_(clock) {}
  [[nodiscard]] std::string describe() const override { return "blocks"; }
  [[nodiscard]] size_t channels() const override { return 1; }
  [[nodiscard]] size_t block_samples() const override { return 64; }
  daq::Outcome start(double rate_Hz) override {
    if (!fault().empty()) return {false, fault()};
    ++starts;
    rate_Hz_ = rate_Hz;
    started_ns_ = clock_.now;
    block_ = 0;
    return {};
  }
  daq::Outcome read(daq::Batch& out) override {
    if (!fault().empty()) return {false, fault()};
    while (clock_.now - started_ns_ >= static_cast<uint64_t>(64e9 * (block_ + 1) / rate_Hz_)) {
      const auto first = static_cast<uint64_t>(64 * block_++);
      if (lost(first)) continue;
      out.first_index = first;
      for (uint64_t i = 0; i < 64; ++i)
        out.volts.push_back(static_cast<double>(first + i));
      break;
    }
    return {};
  }
  void stop() override { ++stops; }

  std::function<std::string()> fault = [] { return std::string(); };
  std::function<bool(uint64_t first)> lost = [](uint64_t) { return false; };
  int starts = 0;
  int stops = 0;

 private:
  StillClock& clock_;
  double rate_Hz_ = 1;
  uint64_t started_ns_ = 0;
  double block_ = 0;
};

constexpr double true_rate_Hz = 300.48;

TEST(BlockSource, EveryBlockIsTakenWithItsIndices) {
  StillClock clock;
  Blocks instrument(clock);
  BlockSource source(clock, instrument);
  const SampleGrid grid = source.start(true_rate_Hz);
  Books books;
  const uint64_t end_ns = grid.first_due_ns + 10 * ns_per_s;
  run_until(source, clock, end_ns, books);
  EXPECT_EQ(books.missing, 0U);
  EXPECT_GE(books.received, grid.due_by(end_ns)) << "a sample comes with its block, 213 ms late";
  for (size_t i = 0; i < books.volts.size(); ++i)
    ASSERT_EQ(books.volts[i], static_cast<double>(i));
  ASSERT_GE(books.times.size(), 40U);
  EXPECT_EQ(books.times[0].timer, 64U);
  EXPECT_EQ(instrument.stops, 1);
  EXPECT_TRUE(source.timer(true_rate_Hz).counts_samples);
}

TEST(BlockSource, LostBlocksAreGapsOfTheirSize) {
  StillClock clock;
  Blocks instrument(clock);
  instrument.lost = [](uint64_t first) { return first == 640 || first == 1280; };
  BlockSource source(clock, instrument);
  const SampleGrid grid = source.start(true_rate_Hz);
  Books books;
  run_until(source, clock, grid.first_due_ns + 10 * ns_per_s, books);
  EXPECT_EQ(books.missing, 128U);
  EXPECT_THAT(books.reasons, testing::ElementsAre("blocks of the instrument were lost"));
  EXPECT_EQ(books.volts[640], 704.0);
}

TEST(BlockSource, AFirstBlockThatIsLostIsAGapAtTheStart) {
  StillClock clock;
  Blocks instrument(clock);
  instrument.lost = [](uint64_t first) { return first == 0; };
  BlockSource source(clock, instrument);
  const SampleGrid grid = source.start(true_rate_Hz);
  Books books;
  run_until(source, clock, grid.first_due_ns + ns_per_s, books);
  EXPECT_EQ(books.missing, 64U);
}

TEST(BlockSource, SilenceIsToldAndAtTheEndCounted) {
  StillClock clock;
  Blocks instrument(clock);
  instrument.lost = [](uint64_t first) { return first >= 640; };
  BlockSource source(clock, instrument);
  const SampleGrid grid = source.start(true_rate_Hz);
  Books books;
  const uint64_t end_ns = grid.first_due_ns + 10 * ns_per_s;
  run_until(source, clock, end_ns, books);
  EXPECT_EQ(books.received, 640U);
  EXPECT_EQ(books.received + books.missing, grid.due_by(end_ns));
  ASSERT_EQ(books.faults.size(), 1U);
  EXPECT_THAT(books.faults[0], testing::HasSubstr("no block came"));
}

TEST(BlockSource, AnInstrumentThatFailsIsStartedAnewAndItsIndicesGoOnByTime) {
  StillClock clock;
  Blocks instrument(clock);
  const uint64_t from_ns = clock.now + 3 * ns_per_s;
  instrument.fault = [&] {
    return clock.now >= from_ns && clock.now < from_ns + 2 * ns_per_s ? std::string("is gone")
                                                                      : std::string();
  };
  BlockSource source(clock, instrument);
  const SampleGrid grid = source.start(true_rate_Hz);
  Books books;
  const uint64_t end_ns = grid.first_due_ns + 10 * ns_per_s;
  run_until(source, clock, end_ns, books);
  EXPECT_EQ(instrument.starts, 2);
  EXPECT_GE(books.received + books.missing, grid.due_by(end_ns));
  // Two seconds, up to a block before, and up to half a second until the next attempt.
  EXPECT_NEAR(static_cast<double>(books.missing), 2.35 * true_rate_Hz, 0.36 * true_rate_Hz);
  EXPECT_THAT(books.reasons, testing::ElementsAre("is gone"));
  EXPECT_THAT(books.faults, testing::ElementsAre("is gone"));
}

/// Sleeps for real when it is told to stall.
class Stalling final : public daq::PolledInstrument {
 public:
  [[nodiscard]] std::string describe() const override { return "stalling"; }
  [[nodiscard]] size_t channels() const override { return 1; }
  daq::Outcome read(std::span<double> volts) override {
    const int stall_ms = stall_ms_.exchange(0);
    std::this_thread::sleep_for(std::chrono::milliseconds(stall_ms));
    volts[0] = 1;
    return {stall_ms == 0, "no answer"};
  }
  void stall(int for_ms) { stall_ms_ = for_ms; }

 private:
  std::atomic<int> stall_ms_ = 0;
};

class RealStall : public testing::TestWithParam<int> {};

TEST_P(RealStall, CostsItsSamplesAndNeverTheOneWhoAsks) {
  Stalling instrument;
  RealClock clock;
  const auto source = make_source(clock, instrument);
  const SampleGrid grid = source->start(500);
  Books books;
  bool stalled = false;
  const uint64_t end_ns = grid.first_due_ns + static_cast<uint64_t>(GetParam()) * ns_per_ms + 300 * ns_per_ms;
  uint64_t turns = 0;
  for (; clock.now_ns() < end_ns || !source->complete(end_ns); ++turns) {
    books.take(source->take());
    if (!stalled && clock.now_ns() > grid.first_due_ns + 100 * ns_per_ms) {
      instrument.stall(GetParam());
      stalled = true;
    }
    clock.sleep_until_ns(clock.now_ns() + ns_per_ms, nullptr);
  }
  books.take(source->finish(end_ns));
  EXPECT_GE(books.received + books.missing, grid.due_by(end_ns));
  EXPECT_GE(books.missing, static_cast<uint64_t>(GetParam()) / 2 - 1);
  EXPECT_GT(books.received, 0U);
}

INSTANTIATE_TEST_SUITE_P(ThreadedSource, RealStall, testing::Values(10, 100, 1000),
                         [](const auto& each) { return std::to_string(each.param) + "_ms"; });

TEST(ThreadedSource, AStallThatOutlastsTheRunIsCountedToItsEnd) {
  Stalling instrument;
  RealClock clock;
  const auto source = make_source(clock, instrument);
  const SampleGrid grid = source->start(500);
  instrument.stall(400);
  Books books;
  const uint64_t end_ns = grid.first_due_ns + 200 * ns_per_ms;
  while (clock.now_ns() < end_ns)
    books.take(source->take());
  books.take(source->finish(end_ns));
  EXPECT_EQ(books.received + books.missing, grid.due_by(end_ns));
  EXPECT_GE(books.missing, 95U);
}

TEST(PolledSource, StallsOfAnyLengthBalance) {
  for (const uint64_t stall_ms : {10U, 57U, 200U, 1000U, 3333U, 10'000U}) {
    StillClock clock;
    class Slow final : public daq::PolledInstrument {
     public:
      Slow(StillClock& slow_clock, uint64_t ns) : clock_(slow_clock), stall_ns_(ns) {}
      [[nodiscard]] std::string describe() const override { return "slow"; }
      [[nodiscard]] size_t channels() const override { return 1; }
      daq::Outcome read(std::span<double> volts) override {
        volts[0] = 0;
        if (reading_++ != 100) return {};
        clock_.now += stall_ns_;
        return {false, "no answer"};
      }

     private:
      StillClock& clock_;
      uint64_t stall_ns_;
      int reading_ = 0;
    } instrument(clock, stall_ms * ns_per_ms);
    PolledSource source(clock, instrument);
    const SampleGrid grid = source.start(300);
    Books books;
    const uint64_t end_ns = grid.first_due_ns + 12 * ns_per_s;
    run_until(source, clock, end_ns, books);
    EXPECT_EQ(books.received + books.missing, grid.due_by(end_ns)) << stall_ms;
    EXPECT_NEAR(static_cast<double>(books.missing), 0.3 * static_cast<double>(stall_ms), 1.01);
  }
}

}  // namespace
}  // namespace diastole
