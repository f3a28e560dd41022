#include <gtest/gtest.h>

#include <cmath>

#include "tools/sim_rig/imperfections.hpp"

namespace diastole::sim_rig {
namespace {

PlantConfig rig(uint64_t seed) {
  PlantConfig plant;
  draw_imperfections(seed, plant);
  return plant;
}

TEST(Imperfections, SeedZeroIsTheRigAsDescribed) {
  const PlantConfig plain;
  EXPECT_EQ(rig(0).hose.length_m, plain.hose.length_m);
  EXPECT_EQ(rig(0).flaws.drive.gain, 0.0);
}

TEST(Imperfections, ASeedIsARig) {
  EXPECT_EQ(rig(3).hose.wave_speed_m_s, rig(3).hose.wave_speed_m_s);
  EXPECT_NE(rig(3).hose.wave_speed_m_s, rig(4).hose.wave_speed_m_s);
}

TEST(Imperfections, HaveTheSpreadThatPartsHave) {
  constexpr int rigs = 400;
  double sum = 0, square = 0;
  for (uint64_t seed = 1; seed <= rigs; ++seed) {
    const PlantConfig drawn = rig(seed);
    const double part = drawn.hose.wave_speed_m_s / PlantConfig{}.hose.wave_speed_m_s - 1;
    sum += part;
    square += part * part;
    EXPECT_LT(std::abs(part), 0.151);
    EXPECT_GE(drawn.flaws.specimen.relaxing[0], 0.003);
    EXPECT_GT(drawn.piston_lag_ms, 0.9);
  }
  // 0.06, cut at two and a half sds; both estimates are right to their own three sds.
  EXPECT_NEAR(sum / rigs, 0, 3 * 0.06 / std::sqrt(rigs));
  EXPECT_NEAR(std::sqrt(square / rigs), 0.0585, 3 * 0.06 / std::sqrt(2.0 * rigs));
}

}  // namespace
}  // namespace diastole::sim_rig
