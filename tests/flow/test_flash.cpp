// `diastole flash` as a person calls it, with program sim_board behind a pseudo-terminal.

#include <gmock/gmock.h>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/flow/programs.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tests/host/flash/update_files.hpp"
#include "tests/sanitized.hpp"

namespace diastole::flow {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string built = DIASTOLE_SOURCE_DIR "/build/firmware/";
const std::string factory_image = built + "bin/diastole-stm32f405.bin";
const std::string newer_update = built + "tests/newer.image";

#define NEEDS_UPDATE_IMAGES()                                   \
  for (const std::string& file : {factory_image, newer_update}) \
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file << ": build the preset `firmware` first"

std::string write_update(const Workplace& workplace, const std::string& name,
                         const flash_test::FileRecipe& recipe) {
  const auto bytes = flash_test::make_update_file(recipe);
  return workplace.write(name, {bytes.begin(), bytes.end()});
}

TEST(FlashCommand, InstallsOverTheLineInterruptedOrNot) {
  if (sanitized) GTEST_SKIP() << "real time, of which sanitizers leave too little";
  NEEDS_UPDATE_IMAGES();
  Workplace workplace;
  const std::string port = (workplace / "port").string();
  Program board(workplace, {"sim_board", factory_image, "--link", port, "--real-time"});
  ASSERT_TRUE(board.wait_for_text("\"port\""));

  const Ended dry = run(workplace, {"diastole", "flash", newer_update, "--port", port, "--dry-run"});
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_THAT(dry.err, HasSubstr("runs 0.1.0, the file holds 0.1.1"));
  EXPECT_THAT(dry.out, HasSubstr("nothing was changed"));

  Program interrupted(workplace, {"diastole", "flash", newer_update, "--port", port, "--json"});
  ASSERT_TRUE(interrupted.wait_for_text(" of "));  // the first quarter is there
  interrupted.signal(SIGINT);
  const Ended stopped = interrupted.wait();
  if (stopped.exit_code == 1) {
    EXPECT_EQ(stopped.json().at("result"), "stopped");
  } else {
    EXPECT_EQ(stopped.exit_code, 0) << "a busy machine may be through before the signal: " << stopped.err;
  }

  const Ended whole =
      run(workplace, {"diastole", "flash", newer_update, "--port", port, "--json", "--force"});
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  const auto report = whole.json();
  EXPECT_EQ(report.at("image"), newer_update);
  EXPECT_EQ(report.at("version"), "0.1.1");
  EXPECT_EQ(report.at("verified"), true);
  EXPECT_GT(report.at("bytes").get<int>(), 10'000);
  EXPECT_GT(report.at("seconds").get<double>(), 0);
  EXPECT_EQ(report.at("result"), "confirmed");

  const std::string other = write_update(workplace, "other.image", {.board_id = 7, .version = {9, 0, 0}});
  const Ended wrong = run(workplace, {"diastole", "flash", other, "--port", port});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("is for board 7, and the controller is board 2"));
  board.signal(SIGINT);
  EXPECT_EQ(board.wait().exit_code, 0);
}

TEST(FlashCommand, MakesAKeyAndSignsWithIt) {
  Workplace workplace;
  const std::string image = write_update(workplace, "built.image", {.version = {1, 0, 0}});
  const std::string key = (workplace / "key.pem").string();
  const Ended made = run(workplace, {"diastole", "flash", "--new-key", key, "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.json().at("result"), "key_made");
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(key).permissions(), perms::owner_read | perms::owner_write);
  const Ended again = run(workplace, {"diastole", "flash", "--new-key", key});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("never overwritten"));

  for (const int counter : {3, 4}) {
    const Ended signed_image = run(workplace, {"diastole", "flash", "--sign", key, image, "--counter",
                                               std::to_string(counter), "--json"});
    ASSERT_EQ(signed_image.exit_code, 0) << signed_image.err;
    EXPECT_EQ(signed_image.json().at("result"), "signed");
    EXPECT_EQ(signed_image.json().at("counter"), counter);
  }
  EXPECT_EQ(run(workplace, {"diastole", "flash", "--sign", key, image, "--json"}).json().at("counter"), 4)
      << "kept where none is given";

  workplace.write("other.pem", "no key");
  const std::string other = (workplace / "other.pem").string();
  std::filesystem::permissions(other, perms::owner_read | perms::owner_write);
  EXPECT_THAT(run(workplace, {"diastole", "flash", "--sign", other, image}).err,
              HasSubstr("is no Ed25519 key"));
  std::filesystem::permissions(other, perms::group_read, std::filesystem::perm_options::add);
  EXPECT_THAT(run(workplace, {"diastole", "flash", "--sign", other, image}).err, HasSubstr("chmod 600"));
  EXPECT_EQ(run(workplace, {"diastole", "flash", image}).exit_code, 2) << "no port";
  EXPECT_EQ(run(workplace, {"diastole", "flash", "--sign", key}).exit_code, 2) << "no image";
}

TEST(FlashCommand, SaysWhatIsWrongWithFileOrPort) {
  Workplace workplace;
  const std::string good = write_update(workplace, "good.image", {.version = {1, 0, 0}});
  const std::string plain = workplace.write("plain.bin", std::string(4096, '\xff'));
  const Ended foreign = run(workplace, {"diastole", "flash", plain, "--port", "/dev/null"});
  EXPECT_EQ(foreign.exit_code, 2);
  EXPECT_THAT(foreign.err, HasSubstr("is no update file"));
  const Ended missing = run(workplace, {"diastole", "flash", "no-such.image", "--port", "/dev/null"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("no-such.image: cannot be read"));
  const Ended no_port = run(workplace, {"diastole", "flash", good, "--port", "/dev/no-such-port"});
  EXPECT_EQ(no_port.exit_code, 3);
  EXPECT_THAT(no_port.err, HasSubstr("there is no such serial port"));
  const Ended usage = run(workplace, {"diastole", "flash", good});
  EXPECT_EQ(usage.exit_code, 2);
}

TEST(FlashCommand, SaysToStopTheDaemonWhenThePortIsTaken) {
  NEEDS_UPDATE_IMAGES();
  Workplace workplace;
  const std::string port = (workplace / "port").string();
  Program board(workplace, {"sim_board", factory_image, "--link", port, "--real-time"});
  ASSERT_TRUE(board.wait_for_text("\"port\""));
  const int held_port = ::open(port.c_str(), O_RDWR | O_NOCTTY);
  ASSERT_EQ(::flock(held_port, LOCK_EX | LOCK_NB), 0);
  const Ended busy = run(workplace, {"diastole", "flash", newer_update, "--port", port});
  EXPECT_EQ(busy.exit_code, 3);
  EXPECT_THAT(busy.err, HasSubstr("in use by another program"));
  EXPECT_THAT(busy.err, HasSubstr("daemon"));
  ::close(held_port);
  board.signal(SIGINT);
  (void)board.wait();
}

/// The emulated chip behind the real daemon, with the image that is flashed; and the same with its bootloader's key erased.
TEST(Status, SaysOfAControllerWithoutAKeyThatItIsNotLocked) {
  NEEDS_UPDATE_IMAGES();
  const auto said_of = [](const std::string& image) {
    RigWithDaemon rig(RigWithDaemon::Time::conducted, source_text("examples/rig.toml"), {"--image", image});
    rig.start_daemon();
    return run(rig.place, {"diastole", "status", "--socket", rig.path("socket")}).out;
  };
  EXPECT_THAT(said_of(factory_image), Not(HasSubstr("NOT LOCKED")));
  constexpr size_t key_at = 0x3FE0, key_bytes = 32;  // memory_map.hpp
  std::ifstream file(factory_image, std::ios::binary);
  std::string image{std::istreambuf_iterator<char>(file), {}};
  image.replace(key_at, key_bytes, key_bytes, '\xFF');
  const Workplace workplace;
  workplace.write("open.bin", image);
  EXPECT_THAT(said_of((workplace / "open.bin").string()), HasSubstr("NOT LOCKED"));
}

}  // namespace
}  // namespace diastole::flow
