#include "host/journal/journal.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include "host/journal/journal_records.hpp"
#include "host/journal/part_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

std::vector<uint8_t> bytes_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  return {chars.begin(), chars.end()};
}

/// Three records of different lengths, the last one empty, and where each ends.
struct SmallJournal {
  Scratch scratch{"journal"};
  std::vector<uint8_t> bytes;
  std::vector<size_t> ends{16 + 5 + 4, 2 * 20 + 5 + 300, 3 * 20 + 5 + 300};

  SmallJournal() {
    JournalWriter writer(scratch / "small.journal");
    EXPECT_TRUE(writer.append(RecordKind::document, std::string("hello")));
    EXPECT_TRUE(writer.append(RecordKind::samples, std::vector<uint8_t>(300, 7)));
    EXPECT_TRUE(writer.append(RecordKind::positions, std::vector<uint8_t>{}));
    bytes = bytes_of(scratch / "small.journal");
  }
};

TEST(Journal, ReadsBackWhatWasWritten) {
  const SmallJournal small;
  ASSERT_EQ(small.bytes.size(), small.ends.back());
  const JournalContents contents = read_journal(small.bytes);
  ASSERT_EQ(contents.records.size(), 3U);
  EXPECT_EQ(contents.records[0].kind, RecordKind::document);
  EXPECT_EQ(std::string(contents.records[0].payload.begin(), contents.records[0].payload.end()), "hello");
  EXPECT_EQ(contents.records[1].payload.size(), 300U);
  EXPECT_EQ(contents.torn_tail_bytes + contents.damaged_bytes + contents.records_lost, 0U);
}

TEST(Journal, ATornTailAtEveryByteKeepsTheRecordsBefore) {
  const SmallJournal small;
  for (size_t length = 0; length <= small.bytes.size(); ++length) {
    const JournalContents contents = read_journal(std::span(small.bytes).first(length));
    size_t whole = 0;
    while (whole < small.ends.size() && small.ends[whole] <= length)
      ++whole;
    ASSERT_EQ(contents.records.size(), whole) << "cut at " << length;
    ASSERT_EQ(contents.torn_tail_bytes, length - (whole == 0 ? 0 : small.ends[whole - 1]));
    ASSERT_EQ(contents.records_lost, 0U);
  }
}

TEST(Journal, EveryFlippedBitCostsOneRecordAtMost) {
  const SmallJournal small;
  for (size_t bit = 0; bit < 8 * small.bytes.size(); ++bit) {
    std::vector<uint8_t> damaged = small.bytes;
    damaged[bit / 8] = static_cast<uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
    const JournalContents contents = read_journal(damaged);
    ASSERT_EQ(contents.records.size(), 2U) << "bit " << bit;
    const bool last_hit = bit / 8 >= small.ends[1];
    ASSERT_EQ(contents.records_lost, last_hit ? 0U : 1U) << "bit " << bit;
  }
}

TEST(Journal, NoiseHoldsNoRecord) {
  std::mt19937 random(11);
  std::vector<uint8_t> noise(100'000);
  for (uint8_t& byte : noise)
    byte = static_cast<uint8_t>(random());
  EXPECT_TRUE(read_journal(noise).records.empty());
}

TEST(Journal, AFullDiskIsToldOnceAndWhatWasWrittenStaysReadable) {
  const Scratch scratch("full");
  const auto path = scratch / "full.journal";
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, old.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  size_t written = 0;
  {
    JournalWriter writer(path);
    while (written < 100 && writer.append(RecordKind::samples, std::vector<uint8_t>(90, 1)))
      ++written;
    EXPECT_THAT(writer.problem(), testing::HasSubstr("cannot be written"));
    EXPECT_FALSE(writer.append(RecordKind::document, std::string("more")));
  }
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(read_journal(path).records.size(), written);
  EXPECT_EQ(written, 9U);
}

TEST(Journal, AFlushThatFailsInTheBackgroundIsKeptAndEndsTheWriting) {
  const Scratch scratch("eio");
  std::atomic<int> flushes = 0;
  JournalWriter writer(scratch / "eio.journal", [&](int) {
    ++flushes;
    flushes.notify_all();
    errno = EIO;
    return -1;
  });
  EXPECT_TRUE(writer.append(RecordKind::document, std::string("kept")));
  flushes.wait(0);
  EXPECT_FALSE(writer.sync()) << "an earlier failure must not be forgotten";
  EXPECT_THAT(writer.problem(), testing::HasSubstr("cannot be brought to the disk"));
  EXPECT_FALSE(writer.append(RecordKind::document, std::string("more")));
  EXPECT_EQ(read_journal(scratch / "eio.journal").records.size(), 1U);
}

/// Waits for the writer's own thread; no sync is asked for.
std::string problem_in_time(const JournalWriter& writer) {
  for (int i = 0; i < 500 && writer.problem().empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return writer.problem();
}

TEST(Journal, RemovedWhileItIsWrittenIsToldAtOnceAndPutBack) {
  const Scratch scratch("removed");
  const auto path = scratch / "run.journal";
  JournalWriter writer(path);
  EXPECT_TRUE(writer.append(RecordKind::document, std::string("hello")));
  EXPECT_TRUE(writer.append(RecordKind::samples, std::vector<uint8_t>(300'000, 7)));
  std::filesystem::remove(path);
  EXPECT_THAT(problem_in_time(writer),
              testing::AllOf(testing::HasSubstr(path.string()), testing::HasSubstr("removed"),
                             testing::HasSubstr("put back")));
  EXPECT_FALSE(writer.append(RecordKind::document, std::string("more")));
  EXPECT_EQ(read_journal(path).records.size(), 2U);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
}

TEST(Journal, MovedOrReplacedWhileItIsWrittenIsToldAndNothingIsTouched) {
  const Scratch scratch("moved");
  const auto path = scratch / "run.journal";
  JournalWriter moved(path);
  EXPECT_TRUE(moved.append(RecordKind::document, std::string("hello")));
  std::filesystem::rename(path, scratch / "elsewhere");
  EXPECT_FALSE(moved.sync());
  EXPECT_THAT(moved.problem(), testing::HasSubstr("moved away"));
  EXPECT_EQ(read_journal(scratch / "elsewhere").records.size(), 1U);
  EXPECT_FALSE(std::filesystem::exists(path));

  JournalWriter replaced(path);
  std::ofstream(scratch / "other") << "another's";
  std::filesystem::rename(scratch / "other", path);
  EXPECT_FALSE(replaced.sync());
  EXPECT_THAT(replaced.problem(), testing::HasSubstr("replaced"));
  EXPECT_EQ(std::filesystem::file_size(path), 9U);
}

TEST(PartFile, OnlyWhatADeadProcessLeftIsTidied) {
  const Scratch scratch("leftovers");
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);
  const std::string dead = std::to_string(child), alive = std::to_string(::getpid());
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
  const auto make = [&](const std::string& name, bool is_old = true) {
    std::ofstream(scratch / name) << "x";
    if (is_old) std::filesystem::last_write_time(scratch / name, old);
  };
  for (const char* kept : {"gel.run.h5", "gel.run.h5.part", "gel.run.h5.x1.part", "gel.txt.0.part"})
    make(kept);
  make("gel.run.h5." + alive + ".part");
  make("gel.run.h5." + dead + ".part");
  make("egg.run.h5." + dead + ".part");
  remove_leftovers(scratch / "gel.run.h5");
  EXPECT_FALSE(std::filesystem::exists(scratch / ("gel.run.h5." + dead + ".part")));
  EXPECT_TRUE(std::filesystem::exists(scratch / ("egg.run.h5." + dead + ".part")));
  make("gel.run.h5." + dead + ".part", false);
  remove_leftovers(scratch.path());
  EXPECT_FALSE(std::filesystem::exists(scratch / ("egg.run.h5." + dead + ".part")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 6);
}

TEST(Journal, SyncWaitsForTheFlushThatIsUnderWay) {
  const Scratch scratch("sync");
  std::atomic<bool> begun = false;
  std::atomic<bool> flushing = false;
  JournalWriter writer(scratch / "sync.journal", [&](int) {
    flushing = true;
    begun = true;
    begun.notify_all();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    flushing = false;
    return 0;
  });
  EXPECT_TRUE(writer.append(RecordKind::document, std::string("hello")));
  begun.wait(false);
  EXPECT_TRUE(writer.sync());
  EXPECT_FALSE(flushing);
}

TEST(Journal, AnExistingJournalIsNeverOverwritten) {
  const SmallJournal small;
  EXPECT_THROW(JournalWriter(small.scratch / "small.journal"), HardwareError);
}

TEST(Journal, AFileThatIsNoJournalIsRefused) {
  const Scratch scratch("nojournal");
  std::ofstream(scratch / "text") << "no journal";
  EXPECT_THROW(read_journal(scratch / "text"), InputError);
  EXPECT_THROW(read_journal(scratch / "absent"), InputError);
}

TEST(JournalRecords, BlocksSurviveAndWrongLengthsDoNot) {
  const SampleBlock block{17, 2, {100, 200, 300}, {1, 2, 3, 4, 5, 6}};
  std::vector<uint8_t> bytes = encode(block);
  const auto back = decode_samples(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->first_index, 17U);
  EXPECT_EQ(back->host_ns, block.host_ns);
  EXPECT_EQ(back->value_kPa, block.value_kPa);
  for (size_t length = 0; length < bytes.size(); ++length)
    ASSERT_FALSE(decode_samples(std::span(bytes).first(length)));
  const PositionBlock positions{5, 1'000'000'000'000, 280'000, {1, -2, 3}};
  const std::vector<uint8_t> packed = encode(positions);
  const auto unpacked = decode_positions(packed);
  ASSERT_TRUE(unpacked);
  EXPECT_EQ(unpacked->microsteps, positions.microsteps);
  EXPECT_EQ(unpacked->first_tick, positions.first_tick);
  for (size_t length = 0; length < packed.size(); ++length)
    ASSERT_FALSE(decode_positions(std::span(packed).first(length)));
}

}  // namespace
}  // namespace diastole
