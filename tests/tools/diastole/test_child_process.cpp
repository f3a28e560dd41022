#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "protocol/contract/input_error.hpp"
#include "tools/diastole/simulate/child_process.hpp"

namespace diastole {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class ChildProcessTest : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(log_); }
  [[nodiscard]] std::vector<std::string> shell(const std::string& script) const {
    return {"/bin/sh", "-c", script};
  }
  std::filesystem::path log_ =
      std::filesystem::temp_directory_path() / ("child_process_test_" + std::to_string(::getpid()) + ".log");
};

TEST_F(ChildProcessTest, GivesItsFirstLineAndItsExitCode) {
  ChildProcess child(shell("trap 'exit 7' TERM; echo ready; while :; do sleep 0.01; done"), log_);
  EXPECT_EQ(child.first_line(5s), "ready");
  EXPECT_TRUE(child.running());
  EXPECT_EQ(child.stop(5s), 7);
  EXPECT_FALSE(child.running());
}

TEST_F(ChildProcessTest, EndsOneThatWillNotEnd) {
  ChildProcess child(shell("trap '' TERM; echo ready; while :; do sleep 0.01; done"), log_);
  child.first_line(5s);
  EXPECT_EQ(child.stop(100ms), 128 + SIGKILL);
}

TEST_F(ChildProcessTest, TellsWhatItSaidWhenItDoesNotStart) {
  ChildProcess child(shell("echo no such port >&2; exit 3"), log_);
  try {
    child.first_line(5s);
    FAIL() << "there is no first line";
  } catch (const HardwareError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no such port"));
  }
  EXPECT_EQ(child.stop(5s), 3);
}

TEST_F(ChildProcessTest, AMissingProgramIsAnErrorThatNamesIt) {
  try {
    ChildProcess child({"/nowhere/sim_rig"}, log_);
    FAIL() << "started";
  } catch (const HardwareError& error) {
    EXPECT_THAT(error.what(), HasSubstr("/nowhere/sim_rig"));
  }
}

TEST_F(ChildProcessTest, DiesWithItsOwner) {
  std::array<int, 2> report{};
  ASSERT_EQ(::pipe(report.data()), 0);
  const pid_t owner = ::fork();
  if (owner == 0) {
    ChildProcess child(shell("echo $$; sleep 60"), log_);
    const auto grandchild = static_cast<pid_t>(std::stol(child.first_line(5s)));
    if (::write(report[1], &grandchild, sizeof grandchild) < 0) ::_exit(1);
    ::raise(SIGKILL);
  }
  pid_t grandchild = 0;
  ASSERT_EQ(::read(report[0], &grandchild, sizeof grandchild), static_cast<ssize_t>(sizeof grandchild));
  ::waitpid(owner, nullptr, 0);
  for (int i = 0; i < 500 && ::kill(grandchild, 0) == 0; ++i) {
    const std::filesystem::path state = "/proc/" + std::to_string(grandchild) + "/stat";
    std::ifstream file(state);
    std::string number, name, letter;
    if (file >> number >> name >> letter && letter == "Z") break;  // nobody reaps orphans in some containers
    ::usleep(10'000);
  }
  std::ifstream file("/proc/" + std::to_string(grandchild) + "/stat");
  std::string number, name, letter = "gone";
  file >> number >> name >> letter;
  EXPECT_THAT(letter, testing::AnyOf("gone", "Z", "X"));
}

}  // namespace
}  // namespace diastole
