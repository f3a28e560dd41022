#include <gtest/gtest.h>

#include "tests/tools/sim_rig/scripted_controller.hpp"
#include "tools/sim_rig/carriage.hpp"

namespace diastole::sim_rig {
namespace {

TEST(Carriage, ClosesItsSwitchAndVentsTheLineUntilItLeavesIt) {
  Carriage carriage(0.01, 200);
  EXPECT_FALSE(carriage.home_switch_closed());
  int told = 0;
  double last_mL = 0;
  bool closed_once = false;
  for (const PinEdge& edge : home_and_inflate(100, 1000)) {
    if (const auto displaced_mL = carriage.take(edge)) {
      ++told;
      last_mL = *displaced_mL;
    }
    closed_once = closed_once || carriage.home_switch_closed();
  }
  EXPECT_TRUE(closed_once);
  EXPECT_EQ(carriage.position_microsteps(), 101);
  EXPECT_EQ(told, 101);
  EXPECT_NEAR(last_mL, 1.01, 1e-12);
}

TEST(Carriage, OnlyRisingStepEdgesMoveIt) {
  Carriage carriage(0.01, 0);
  carriage.take({0, Pin::dir, 1});
  carriage.take({1, Pin::step, 0});
  carriage.take({2, Pin::ttl, 1});
  EXPECT_EQ(carriage.position_microsteps(), 0);
  carriage.take({3, Pin::step, 1});
  EXPECT_EQ(carriage.position_microsteps(), 1);
}

}  // namespace
}  // namespace diastole::sim_rig
