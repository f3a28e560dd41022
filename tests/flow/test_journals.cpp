// Journals and disks through the programs: a disk that cannot hold a run or fills during it, journals listed,
// and outputs that would replace an input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <csignal>

#include "protocol/contract/input_error.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

/// A small file system of its own, if one may be mounted here.
class SmallDisk {
 public:
  SmallDisk(std::filesystem::path at, const std::string& size) : at_(std::move(at)) {
    std::filesystem::create_directories(at_);
    mounted_ = ::mount("none", at_.c_str(), "tmpfs", 0, ("size=" + size).c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(at_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  [[nodiscard]] bool mounted() const { return mounted_; }

 private:
  std::filesystem::path at_;
  bool mounted_ = false;
};

TEST(Journals, ARunThatTheDiskCannotHoldIsRefusedBeforeItMoves) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  const SmallDisk disk(rig.place / "journals", "2m");
  if (!disk.mounted()) GTEST_SKIP() << "no file system may be mounted here";
  rig.start_daemon();
  auto client = rig.client();
  home(client);
  rig.place.write("long.experiment.toml",
                  with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = 50000"));
  const Ended refused = run(rig.place, {"diastole", "run", "long.experiment.toml", "-o", "long.run.h5",
                                        "--socket", rig.path("socket")});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, AllOf(HasSubstr("journals"), HasSubstr("needs about"), HasSubstr("2.1 MB free")));
  EXPECT_EQ(client.call("rig.status")["state"], "homed");
}

TEST(Journals, ADiskThatFillsStopsThePumpAndKeepsWhatWasRecorded) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  const SmallDisk disk(rig.place / "journals", "2m");
  if (!disk.mounted()) GTEST_SKIP() << "no file system may be mounted here";
  rig.start_daemon();
  auto client = rig.client();
  home(client);
  client.call("run.start", many_segments());
  while (client.call("run.progress").at("received") < 300) {
  }
  // Somebody else takes the room.
  (void)run_line(rig.place, "head -c 4M /dev/zero > journals/somebody-elses");
  const json status = status_when(client, "homed", true);
  const json progress = client.call("run.progress");
  EXPECT_EQ(progress["state"], "failed") << progress.dump();
  EXPECT_THAT(progress.dump(), HasSubstr("No space left on device"));
  const std::string journal = progress["result"]["journal"];
  const Ended recovered = run(rig.place, {"diastole", "recover", journal, "-o", "saved.run.h5", "--json"});
  EXPECT_EQ(recovered.exit_code, 1) << recovered.err;
  EXPECT_GT(recovered.json()["recovered_samples"], 0);
  EXPECT_EQ(status["fault"], nullptr);
  EXPECT_EQ(run(rig.place, {"diastole", "inspect", "saved.run.h5"}).exit_code, 1);
}

TEST(Journals, AStartThatFailsAfterTheLoadLeavesNothingArmedAndNoJournal) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto client = rig.client();
  home(client);
  std::filesystem::remove_all(rig.place / "journals");
  EXPECT_THAT(message_of<HardwareError>([&] { client.call("run.start", many_segments()); }),
              HasSubstr("the journal cannot be created"));
  EXPECT_EQ(client.call("rig.status")["state"], "homed");
  std::filesystem::create_directory(rig.place / "journals");
  client.call("run.start", many_segments());
  client.call("run.stop");
  EXPECT_EQ(status_when(client, "homed", true)["journals"]["count"], 1);
}

TEST(Journals, AProgramThatTheControllerRefusesLeavesNothingArmedAndNoJournal) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto client = rig.client();
  home(client);
  json wild = many_segments();
  wild["experiment"] = wild["experiment"].get<std::string>() +
                       "[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 400.0\nperiod_s = 0.3\n";
  EXPECT_THAT(message_of<InputError>([&] { client.call("run.start", wild); }),
              AllOf(HasSubstr("segment[60]"), HasSubstr("the controller refuses it")));
  const json status = client.call("rig.status");
  EXPECT_EQ(status["state"], "homed");
  EXPECT_EQ(status["journals"]["count"], 0);
  client.call("run.start", many_segments());
  client.call("run.stop");
  EXPECT_EQ(status_when(client, "homed", true)["journals"]["count"], 1);
}

TEST(Journals, StatusAndListTellWhatIsKept) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto client = rig.client();
  home(client);
  client.call("run.start", many_segments());
  client.call("run.stop");
  status_when(client, "homed", true);
  client.call("control.release");
  client.call("run.start", many_segments());
  rig.daemon->signal(SIGKILL);
  rig.daemon->wait();
  rig.start_daemon();
  const Ended status = run(rig.place, {"diastole", "status", "--socket", rig.path("socket")});
  EXPECT_THAT(status.out, AllOf(HasSubstr("journals  2,"), HasSubstr("1 without a run file"),
                                HasSubstr("diastole recover --list"), HasSubstr("30 days")));
  const json listed =
      run(rig.place, {"diastole", "recover", "--list", "journals", "--json"}).json()["journals"];
  ASSERT_EQ(listed.size(), 2U);
  EXPECT_NE(listed[0]["run_file"].is_null(), listed[1]["run_file"].is_null());
  const Ended in_words = run(rig.place, {"diastole", "recover", "--list", "journals"});
  EXPECT_THAT(in_words.out, AllOf(HasSubstr("closed in order"), HasSubstr("broke off")));
}

TEST(Journals, NoOutputReplacesAnInput) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto client = rig.client();
  home(client);
  const json begun = client.call("run.start", many_segments());
  client.call("run.stop");
  status_when(client, "homed", true);
  client.call("control.release");
  const std::string journal = begun["journal"];
  for (const std::string& output :
       {journal, std::string("journals/../") + journal.substr(journal.find("journals"))}) {
    const Ended ended = run(rig.place, {"diastole", "recover", journal, "-o", output, "--force"});
    EXPECT_EQ(ended.exit_code, 2) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr("would be replaced"));
  }
  const std::string experiment =
      rig.place.write("gel.experiment.toml", source_text("examples/gel.experiment.toml"));
  const auto run_to = [&](const std::string& output) {
    return run(rig.place,
               {"diastole", "run", experiment, "-o", output, "--force", "--socket", rig.path("socket")});
  };
  EXPECT_EQ(run_to(experiment).exit_code, 2);
  EXPECT_THAT(run_to(journal).err, HasSubstr("is a journal"));
  EXPECT_EQ(run(rig.place, {"diastole", "recover", journal, "-o", "again.run.h5"}).exit_code, 0);
}

}  // namespace
}  // namespace diastole::flow
