#include "protocol/signal/step_response.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace diastole::signal {
namespace {

TEST(StepResponse, IsTheSolutionOfTheOscillatorsEquation) {
  for (const double zeta : {0.05, 0.6, 0.999999, 1.0, 1.000001, 3.0}) {
    const SecondOrder system{20, zeta};
    const double w = 2 * M_PI * 20, h = 1e-4;
    for (const double t : {0.002, 0.01, 0.05, 0.3}) {
      const double s = unit_step(system, t);
      const double later = unit_step(system, t + h), earlier = unit_step(system, t - h);
      const double curvature = (later - 2 * s + earlier) / (h * h), slope = (later - earlier) / (2 * h);
      EXPECT_NEAR(curvature / (w * w) + 2 * zeta / w * slope + s, 1, 2e-4) << zeta << " " << t;
    }
  }
  EXPECT_EQ(unit_step({20, 0.5}, -1), 0);
  EXPECT_NEAR(unit_step({20, 5}, 100), 1, 1e-9);
}

TEST(StepResponse, LimitsAreWhereAmplitudeAndLagSaySo) {
  for (const SecondOrder& system : {SecondOrder{60, 0.6}, {30, 0.15}, {20, 1.8}}) {
    EXPECT_NEAR(amplitude_at(system, minus_3dB_Hz(system)), std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(lag_periods_at(system, lag_limit_Hz(system)), 0.05, 1e-12);
    EXPECT_NEAR(std::abs(amplitude_at(system, flat_limit_Hz(system)) - 1), 0.05, 1e-9);
    for (double f = 0; f < 0.999 * flat_limit_Hz(system); f += 0.01)
      EXPECT_LT(std::abs(amplitude_at(system, f) - 1), 0.05);
    EXPECT_NEAR(lag_periods_at(system, 0.01) / 0.01, delay_s(system), 1e-6);
  }
}

}  // namespace
}  // namespace diastole::signal
