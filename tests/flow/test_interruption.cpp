// Ctrl-C and kill: what was recorded is kept, and nothing is left running or lying about.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "tests/flow/programs.hpp"

namespace diastole::flow {
namespace {

using namespace std::chrono_literals;
using testing::IsEmpty;

std::string long_experiment(const Workplace& place) {
  return place.write("long.experiment.toml",
                     with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = 5000"));
}

/// Command lines of the processes that work in `place`, apart from those that have ended.
std::vector<std::string> left_running(const Workplace& place) {
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "cmdline");
    const std::string line(std::istreambuf_iterator<char>(file), {});
    if (line.find(place.path().string()) != std::string::npos) found.push_back(line);
  }
  return found;
}

/// Waits up to ten seconds for all of them to end.
std::vector<std::string> still_running(const Workplace& place) {
  for (int i = 0; i < 1000 && !left_running(place).empty(); ++i)
    std::this_thread::sleep_for(10ms);
  return left_running(place);
}

TEST(Interruption, CtrlCStopsAtTheCyclesEndAndKeepsTheRun) {
  const Workplace place;
  Program simulate(place, {"diastole", "simulate", long_experiment(place), "-o", "long.run.h5", "--pins",
                           "pins.csv", "--json"});
  ASSERT_TRUE(simulate.wait_for_text("cycle ")) << simulate.err();
  EXPECT_FALSE(left_running(place).empty()) << "the rig and the daemon should be at work";
  simulate.signal(SIGINT);
  const Ended ended = simulate.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  const auto session = ended.json();
  EXPECT_LT(session["cycles"], 5000);
  EXPECT_EQ(session["cycles"], session["triggers"]);
  EXPECT_EQ(session["end"], "stopped_at_cycle_end");
  const Ended inspected = run(place, {"diastole", "inspect", "long.run.h5", "--json"});
  EXPECT_EQ(inspected.exit_code, 0);
  EXPECT_EQ(inspected.json()["stopped_on_request"], true) << "a run that ended early on request must be told";
  EXPECT_EQ(inspected.json()["scheduled_cycles"], 5000);
  EXPECT_TRUE(std::filesystem::exists(place / "pins.csv"));
  EXPECT_THAT(still_running(place), IsEmpty());
  EXPECT_TRUE(std::filesystem::is_empty(place.temporary()));
}

TEST(Interruption, AKilledSimulationLeavesNoProcessBehind) {
  const Workplace place;
  Program simulate(place, {"diastole", "simulate", long_experiment(place), "-o", "long.run.h5"});
  ASSERT_TRUE(simulate.wait_for_text("cycle ")) << simulate.err();
  simulate.signal(SIGKILL);
  simulate.wait();
  EXPECT_THAT(still_running(place), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(place / "long.run.h5"));
}

}  // namespace
}  // namespace diastole::flow
