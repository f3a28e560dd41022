#include "protocol/runfile/note_writer.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <sys/wait.h>
#include <filesystem>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::runfile {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

class NoteWriter : public testing::Test {
 protected:
  NoteWriter() {
    std::string name = (fs::temp_directory_path() / "diastole-XXXXXX").string();
    folder = ::mkdtemp(name.data());
    run = folder / "a.run.h5";
    fs::copy_file(test::recorded("rig/case-028/baseline.run.h5"), run);
    fs::permissions(run, fs::perms::owner_write, fs::perm_options::add);
  }
  ~NoteWriter() override { fs::remove_all(folder); }
  fs::path folder, run;
};

TEST_F(NoteWriter, NotesAreAppendedAndTheDataStayAsTheyWere) {
  const RecordedRun before = read_run(run);
  EXPECT_TRUE(read_session(run).empty());
  append_note(run, {"2026-11-23T14:00:00Z", "Jo", "the hose was warm – 30 °C"});
  append_note(run, {"2026-11-24T08:00:00Z", "Ann", "repeated"});
  const Session session = read_session(run);
  EXPECT_THAT(session.notes, ElementsAre(Field(&SessionNote::text, "the hose was warm – 30 °C"),
                                         Field(&SessionNote::text, "repeated")));
  EXPECT_EQ(session.notes[0].author, "Jo");
  EXPECT_EQ(session.notes[1].written_utc, "2026-11-24T08:00:00Z");
  const RecordedRun after = read_run(run);
  EXPECT_EQ(after.pressure.time_s, before.pressure.time_s);
  EXPECT_EQ(after.pressure.channels, before.pressure.channels);
  EXPECT_EQ(after.pump.commanded_mL, before.pump.commanded_mL);
  EXPECT_EQ(after.trigger_s, before.trigger_s);
  EXPECT_EQ(after.rig, before.rig);
  EXPECT_EQ(after.run_id, before.run_id);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST_F(NoteWriter, ALinkStaysALinkAndItsRunGetsTheNote) {
  const fs::path link = folder / "link.run.h5";
  fs::create_symlink(run, link);
  append_note(link, {"", "Jo", "by the link"});
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(read_session(run).notes.size(), 1U);
}

TEST_F(NoteWriter, ANoteOfBlanksAndWhatIsNoRunAreRefused) {
  EXPECT_THROW(append_note(run, {"", "", " \n"}), InputError);
  EXPECT_THROW(append_note(folder / "missing.run.h5", {"", "", "note"}), InputError);
  EXPECT_TRUE(read_session(run).empty());
}

TEST_F(NoteWriter, WhatSteersATerminalOrIsNotUtf8IsRefused) {
  EXPECT_THROW(append_note(run, {"", "Jo", "red \x1b[31m"}), InputError);
  EXPECT_THROW(append_note(run, {"", "Jo", "warm\xE4"}), InputError);
  EXPECT_THROW(append_note(run, {"", "J\x1b[31m", "warm"}), InputError);
  EXPECT_TRUE(read_session(run).empty());
}

TEST_F(NoteWriter, TwoWhoWriteAtTheSameTimeBothAreKept) {
  const auto write = [&](const std::string& author) {
    for (int i = 0; i < 4; ++i)
      append_note(run, {"", author, "note"});
  };
  // HDF5 is used by one thread at a time: two processes write.
  const pid_t child = ::fork();
  if (child == 0) {
    write("child");
    ::_exit(0);
  }
  write("parent");
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read_session(run).notes.size(), 8);
}

}  // namespace
}  // namespace diastole::runfile
