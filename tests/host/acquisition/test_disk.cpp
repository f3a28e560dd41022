// What a disk holds: room for a run before it starts, and which journals are kept after it.

#include <gmock/gmock.h>

#include <fstream>

#include "host/acquisition/disk_space.hpp"
#include "host/journal/journal_store.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace std::chrono_literals;

TEST(DiskSpace, TheEstimateHoldsTheRunAndIsNotFarAboveIt) {
  SessionOnDesk session(short_session);
  session.run();
  const double seconds = session.experiment.least_duration_s();
  const uint64_t fixed = required_space({0, 300, 300, 1, 0}).journal_bytes;
  const uint64_t journal = required_space({seconds, 300, 300, 1, 2}).journal_bytes - fixed;
  const uint64_t written = std::filesystem::file_size(session.journal);
  EXPECT_GT(journal + fixed, written);
  EXPECT_LT(journal, 2 * written);
}

TEST(DiskSpace, ARunThatTheDiskCannotHoldIsRefusedWithBothFigures) {
  const Scratch scratch("room");
  EXPECT_NO_THROW(check_disk_space(scratch.path(), {10, 300, 300, 1, 10}));
  EXPECT_THAT(message_of<InputError>([&] {
                check_disk_space(scratch.path(), {1e12, 300, 300, 1, 10});
              }),
              AllOf(HasSubstr(scratch.path().string()), HasSubstr("free"), HasSubstr("needs about"),
                    HasSubstr("journal_dir")));
}

/// A directory with journals and run files of chosen ages.
struct Store {
  Scratch scratch{"store"};
  void journal(const std::string& name) const { std::ofstream(scratch / (name + ".journal")) << "DJR1..."; }
  void run_file(const std::string& name, std::chrono::hours age,
                const char* head = "\x89HDF\r\n\x1a\n") const {
    const auto path = scratch / (name + ".run.h5");
    std::ofstream(path, std::ios::binary) << head;
    std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now() - age);
  }
};

TEST(JournalStore, OnlyAJournalWhoseRunFileIsOldIsRemoved) {
  const Store store;
  for (const char* name : {"old", "new", "lonely", "broken"})
    store.journal(name);
  store.run_file("old", 1000h);
  store.run_file("new", 1h);
  store.run_file("broken", 1000h, "");
  std::ofstream(store.scratch / "notes.txt") << "keep me";
  const auto before = std::filesystem::file_time_type::clock::now() - 720h;
  EXPECT_THAT(prune_journals(store.scratch.path(), before), ElementsAre(store.scratch / "old.journal"));
  EXPECT_THAT(prune_journals(store.scratch.path(), before), IsEmpty());
  for (const char* kept : {"old.run.h5", "new.journal", "lonely.journal", "broken.journal", "notes.txt"})
    EXPECT_TRUE(std::filesystem::exists(store.scratch / kept)) << kept;
  EXPECT_EQ(stored_journals(store.scratch.path()).size(), 3U);
}

TEST(JournalStore, ADirectoryThatIsNotThereHasNone) {
  EXPECT_THAT(stored_journals("/no/such/place"), IsEmpty());
}

TEST(Acquisition, AFullDiskStopsThePumpUnderControlAndLeavesAReadableJournal) {
  SessionOnDesk session(short_session);
  size_t room = 12'000;
  session.write = [&](int file, const void* bytes, size_t size) {
    const size_t accepted = std::min(room, size);
    room -= accepted;
    if (accepted == 0) errno = ENOSPC;
    return accepted == 0 ? ssize_t{-1} : ::write(file, bytes, accepted);
  };
  session.run();
  EXPECT_EQ(session.outcome.end, "journal_failed");
  EXPECT_EQ(session.remarks.back().code, "journal_failed");
  EXPECT_THAT(session.remarks.back().text, HasSubstr("No space left"));
  EXPECT_EQ(session.client.status().state, wire::State::homed) << "stopped under control: the place is known";
  const AssembledRun assembled = session.assemble();
  EXPECT_GT(assembled.samples_received, 50U);
  EXPECT_FALSE(assembled.ended_in_order);
  EXPECT_NO_THROW(runfile::check(assembled.run));
}

}  // namespace
}  // namespace diastole
