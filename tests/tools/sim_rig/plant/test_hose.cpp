#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tools/sim_rig/plant/hose.hpp"

namespace diastole::sim_rig {
namespace {

HoseConfig lossless() {
  HoseConfig config;
  config.friction = false;
  config.wall_creep_fraction = 0;
  return config;
}

/// The flow into a reservoir held at zero pressure.
double into_reservoir(const Hose& hose) {
  return hose.outlet().pressure_kPa / hose.outlet().impedance_kPa_s_per_mL;
}

TEST(Hose, AFlowStepRaisesJoukowskysPressure) {
  Hose hose(lossless());
  hose.advance(10, 0);
  const double area_m2 = std::numbers::pi / 4 * 0.012 * 0.012;
  const double joukowsky_kPa = 1005 * 400 * (10e-6 / area_m2) / 1000;
  EXPECT_NEAR(hose.pump_end_kPa(), joukowsky_kPa, 1e-9);
}

TEST(Hose, TheWaveReachesTheFarEndAfterLengthOverSpeed) {
  Hose hose(lossless());
  int steps = 0;
  while (hose.cavity_end_kPa() == 0 && steps < 1000) {
    hose.advance(10, 0);
    ++steps;
  }
  EXPECT_NEAR((steps - 1) * hose.step_s(), 5.0 / 400, 1e-12);
}

TEST(Hose, ResonatesAtAQuarterWave) {
  Hose hose(lossless());
  int crossings = 0;
  double first_s = 0;
  double last_s = 0;
  double before = 0;
  for (int i = 1; i * hose.step_s() < 2.0; ++i) {
    hose.advance(10, into_reservoir(hose));
    const double deviation = hose.pump_end_kPa();
    if (before * deviation < 0) {
      last_s = i * hose.step_s();
      if (crossings++ == 0) first_s = last_s;
    }
    if (deviation != 0) before = deviation;
  }
  const double frequency_Hz = (crossings - 1) / (2 * (last_s - first_s));
  EXPECT_NEAR(frequency_Hz, 400 / (4 * 5.0), 0.02 * 20);
}

TEST(Hose, ConservesVolumeToRounding) {
  Hose hose(HoseConfig{});
  double in_mL = 0;
  double before_mL_s = 0;
  for (int i = 1; i <= 5000; ++i) {
    const double flow_mL_s = 30 * std::sin(i * 0.02);
    hose.advance(flow_mL_s, 0);
    in_mL += 0.5 * hose.step_s() * (before_mL_s + flow_mL_s);
    before_mL_s = flow_mL_s;
    ASSERT_NEAR(hose.stored_mL(), in_mL, 1e-10);
  }
}

TEST(Hose, SteadyFrictionIsPoiseuillesAndBlasius) {
  const Hose hose(HoseConfig{});
  const double laminar_mL_s = 10;  // Re 1066
  const double poiseuille_kPa_m =
      128 * 0.001 * laminar_mL_s * 1e-6 / (std::numbers::pi * std::pow(0.012, 4)) / 1000;
  EXPECT_NEAR(hose.steady_friction_kPa_per_m(laminar_mL_s), poiseuille_kPa_m, 1e-9);
  const double turbulent_mL_s = 133;
  const double speed_m_s = turbulent_mL_s * 1e-6 / (std::numbers::pi / 4 * 0.012 * 0.012);
  const double reynolds = 1005 * speed_m_s * 0.012 / 0.001;
  const double blasius_kPa_m =
      0.3164 / std::pow(reynolds, 0.25) * 1005 * speed_m_s * speed_m_s / (2 * 0.012) / 1000;
  EXPECT_NEAR(hose.steady_friction_kPa_per_m(turbulent_mL_s), blasius_kPa_m, 1e-9);
  EXPECT_DOUBLE_EQ(hose.steady_friction_kPa_per_m(-turbulent_mL_s),
                   -hose.steady_friction_kPa_per_m(turbulent_mL_s));
}

TEST(Hose, SteadyFlowDropsTheFrictionOverItsLength) {
  Hose hose(HoseConfig{});
  double flow_mL_s = 0;
  for (int i = 0; i < 20000; ++i) {
    flow_mL_s = std::min(100.0, flow_mL_s + 0.05);
    hose.advance(flow_mL_s, into_reservoir(hose));
  }
  EXPECT_NEAR(hose.pump_end_kPa(), 5 * hose.steady_friction_kPa_per_m(100), 0.01);
}

TEST(Hose, WallCreepRelaxesAClosedLineByItsFraction) {
  HoseConfig config = lossless();
  config.friction = true;
  config.wall_creep_fraction = 0.05;
  Hose hose(config);
  for (int i = 0; i < 20; ++i)
    hose.advance(0.1, 0);
  hose.advance(0, 0);
  const double filled_mL = hose.stored_mL();
  for (int i = 0; i < 20'000; ++i)
    hose.advance(0, 0);
  // A line closed at both ends keeps its highest mode, one sign a step, undamped: take it out.
  const double odd_kPa = hose.pump_end_kPa();
  hose.advance(0, 0);
  const double settled_kPa = 0.5 * (odd_kPa + hose.pump_end_kPa());
  const double elastic_mL_per_kPa = std::numbers::pi / 4 * 0.012 * 0.012 * 5 / (1005.0 * 400 * 400) * 1e9;
  EXPECT_NEAR(settled_kPa, filled_mL / (1.05 * elastic_mL_per_kPa), 0.002 * settled_kPa);
}

}  // namespace
}  // namespace diastole::sim_rig
