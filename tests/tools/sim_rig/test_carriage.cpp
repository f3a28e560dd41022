#include <gtest/gtest.h>

#include <vector>

#include "tests/tools/sim_rig/scripted_controller.hpp"
#include "tools/sim_rig/carriage.hpp"

namespace diastole::sim_rig {
namespace {

TEST(Carriage, VentsTheLineUntilHomingEnds) {
  Carriage carriage(0.01, ScriptedController({}).places());
  std::vector<double> reported_mL;
  for (const sim_controller::PinEdge& edge : home_and_inflate(100, 1000)) {
    if (const auto displaced_mL = carriage.take(edge, 0)) reported_mL.push_back(*displaced_mL);
  }
  ASSERT_EQ(reported_mL.size(), 101U);
  EXPECT_DOUBLE_EQ(reported_mL.front(), 0);
  EXPECT_NEAR(reported_mL.back(), 1.0, 1e-12);
}

TEST(Carriage, OnlyRisingStepEdgesMoveIt) {
  Carriage carriage(0.01, {.parked = 0, .home = 0});
  carriage.take({0, sim_controller::Pin::dir, 1}, 0);
  EXPECT_FALSE(carriage.take({1, sim_controller::Pin::step, 0}, 0));
  EXPECT_FALSE(carriage.take({2, sim_controller::Pin::ttl, 1}, 0));
  EXPECT_TRUE(carriage.take({3, sim_controller::Pin::step, 1}, 0));
}

}  // namespace
}  // namespace diastole::sim_rig
