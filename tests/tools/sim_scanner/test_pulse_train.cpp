#include "tools/sim_scanner/pulse_train.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace diastole::scanner {
namespace {

constexpr double right_angle = std::numbers::pi / 2;

TEST(PulseTrain, TwoPulsesLeaveACosine) {
  constexpr std::array weights{1.0, 1.0};
  for (double phase = -4; phase < 4; phase += 0.3)
    EXPECT_NEAR(tagged_magnetisation(weights, right_angle, phase), 0.5 * (1 - std::cos(phase)), 1e-12);
}

TEST(PulseTrain, AnyWeightsOfARightAngleAreDarkAtPhaseZeroAndAnyTrainRepeats) {
  constexpr std::array weights{1.0, 3.0, 3.0, 1.0};
  EXPECT_NEAR(tagged_magnetisation(weights, right_angle, 0), 0, 1e-12);
  EXPECT_NEAR(tagged_magnetisation(weights, 1.0, 0), std::cos(1.0), 1e-12);
  EXPECT_NEAR(tagged_magnetisation(weights, 1.0, 0.7),
              tagged_magnetisation(weights, 1.0, 0.7 - 2 * std::numbers::pi), 1e-12);
  // Four pulses make narrower stripes than two: at a quarter turn nearly all is left.
  EXPECT_GT(tagged_magnetisation(weights, right_angle, right_angle), 0.8);
}

TEST(PulseTrain, WhatIsLeftRecoversWithT1) {
  EXPECT_NEAR(recovered(0, 0, 0.8), 0, 1e-15);
  EXPECT_NEAR(recovered(0, 0.8, 0.8), 1 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(recovered(-1, 0.8, 0.8), 1 - 2 * std::exp(-1.0), 1e-15);
}

}  // namespace
}  // namespace diastole::scanner
