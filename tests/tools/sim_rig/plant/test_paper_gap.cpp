#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tools/sim_rig/plant/plant.hpp"

namespace diastole::sim_rig {
namespace {

struct Range {
  double least_kPa = 1e9, most_kPa = -1e9, least_mL = 1e9, most_mL = -1e9;
};

/// Parabolic cycles of 40 mL in 1.2 s; what the cavity does from the tenth on.
Range paper_like(double wave_speed_m_s, double loss_K) {
  PlantConfig rig;
  rig.hose.wave_speed_m_s = wave_speed_m_s;
  rig.hose.segments = segments_for(rig.hose);
  rig.minor_loss_K = loss_K;
  Plant plant(rig);
  Range range;
  constexpr double period_s = 1.2, stroke_mL = 40.0;
  for (double t = 0; t < 11 * period_s; t += 1e-3) {
    const double phase = std::fmod(t, period_s) / period_s;
    const double part = std::abs(phase - 0.5) < 0.25 ? 1 - 8 * (phase - 0.5) * (phase - 0.5)
                                                     : 8 * std::pow(std::min(phase, 1 - phase), 2);
    plant.displace(t, stroke_mL * part);
    plant.advance_to(t);
    if (t < 9 * period_s) continue;
    range.least_kPa = std::min(range.least_kPa, plant.cavity_kPa());
    range.most_kPa = std::max(range.most_kPa, plant.cavity_kPa());
    range.least_mL = std::min(range.least_mL, plant.cavity_mL());
    range.most_mL = std::max(range.most_mL, plant.cavity_mL());
  }
  return range;
}

// The figures of examples/paper-gap/README.md.
TEST(PaperGap, ASoftHoseAloneResonatesAndAThrottledOneGivesWhatWasRecorded) {
  const Range described = paper_like(400, 1.5);
  EXPECT_NEAR(described.most_kPa, 4.8, 0.05);
  EXPECT_NEAR(described.most_mL, 40.0, 0.3);
  const Range soft = paper_like(15, 1.5);
  EXPECT_NEAR(soft.most_kPa, 6.8, 0.1);
  EXPECT_NEAR(soft.least_kPa, -5.0, 0.1);
  EXPECT_NEAR(soft.most_mL, 61, 1);
  const Range softest = paper_like(8, 1.5);
  EXPECT_NEAR(softest.most_kPa, 3.5, 0.1);
  EXPECT_NEAR(softest.least_kPa, -1.3, 0.1);
  const Range throttled = paper_like(12, 100);
  EXPECT_NEAR(throttled.most_kPa, 3.2, 0.1);
  EXPECT_NEAR(throttled.least_kPa, 0.2, 0.1);
  EXPECT_NEAR(throttled.most_mL, 24, 0.7);
}

}  // namespace
}  // namespace diastole::sim_rig
