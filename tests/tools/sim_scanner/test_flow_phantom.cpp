#include "tools/sim_scanner/flow_phantom.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace diastole::scanner {
namespace {

TEST(FlowPhantom, ItsProfileCarriesItsFlowAndStandsStillAtTheWall) {
  const FlowPhantom phantom{.bore_mm = 10, .steady_mL_s = 3};
  for (const double time_s : {0.0, 0.13, 0.31, 0.77}) {
    const VelocityProfile profile(phantom, time_s);
    constexpr int rings = 2000;
    double flow_mL_s = 0;
    for (int i = 0; i < rings; ++i) {
      const double step_mm = 5.0 / rings, radius_mm = (i + 0.5) * step_mm;
      flow_mL_s += 2 * std::numbers::pi * radius_mm * step_mm * 0.01 * profile.at(radius_mm);
    }
    EXPECT_NEAR(flow_mL_s, phantom.flow_mL_s(time_s), 1e-3 * 70) << time_s;
    EXPECT_NEAR(profile.at(5.0), 0, 1e-9);
  }
}

TEST(FlowPhantom, SlowPulsesAreParabolicAndFastOnesAPlug) {
  // alpha = a sqrt(omega / nu): 0.3, and 30.
  const FlowPhantom thick{.viscosity_mm2_s = 2000, .harmonics = 1};
  const VelocityProfile parabola(thick, 0.3);
  EXPECT_NEAR(parabola.at(3.0) / parabola.at(0.0), 0.75, 0.01);
  const FlowPhantom thin{.viscosity_mm2_s = 0.2, .harmonics = 1};
  const VelocityProfile plug(thin, 0.3);
  EXPECT_NEAR(plug.at(3.0) / plug.at(0.0), 1, 0.01);
}

TEST(FlowPhantom, VolumeIsTheFlowsIntegral) {
  const FlowPhantom phantom;
  double volume_mL = 0;
  constexpr int steps = 6000;
  for (int i = 0; i < steps; ++i)
    volume_mL += 0.5 / steps * phantom.flow_mL_s(0.5 * (i + 0.5) / steps);
  EXPECT_NEAR(volume_mL, phantom.volume_mL(0.5), 1e-5);
  EXPECT_NEAR(phantom.volume_mL(phantom.period_s), 0, 1e-9);
  // All harmonics of constant acceleration make the stroke; a few lose half a percent.
  EXPECT_NEAR(phantom.volume_mL(0.62) - phantom.volume_mL(0.02), 20, 0.15);
}

TEST(FlowPhantom, FollowsAVolumeThatIsKnownAtTimes) {
  FlowPhantom phantom{.period_s = 1.2};
  const auto volume_mL = [](double time_s) {
    const double turn = 2 * std::numbers::pi * time_s / 1.2;
    return 16 * (1 - std::cos(turn)) + 3 * std::sin(2 * turn + 0.4);
  };
  std::vector<double> times_s, known_mL;
  for (int k = 0; k < 12; ++k) {
    times_s.push_back(0.007 + 0.099 * k);
    known_mL.push_back(volume_mL(times_s.back()));
  }
  phantom.follow(times_s, known_mL);
  for (const double time_s : {0.05, 0.3, 0.71, 1.1})
    EXPECT_NEAR(phantom.volume_mL(time_s), volume_mL(time_s) - volume_mL(0), 1e-9) << time_s;
  EXPECT_NEAR(phantom.volume_mL(1.2), 0, 1e-9);
}

}  // namespace
}  // namespace diastole::scanner
