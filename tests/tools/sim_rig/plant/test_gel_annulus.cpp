#include <gtest/gtest.h>

#include "tools/sim_rig/plant/gel_annulus.hpp"

namespace diastole::sim_rig {
namespace {

TEST(GelAnnulus, PassesThroughTheConvergedFiniteElementPoints) {
  EXPECT_NEAR(GelAnnulus(8.8).pressure_kPa(23.883), 3.1, 1e-12);
  EXPECT_NEAR(GelAnnulus(4.0).pressure_kPa(35.761), 2.0, 1e-12);
  EXPECT_NEAR(GelAnnulus(6.5).pressure_kPa(78.351), 6.0, 1e-12);
}

TEST(GelAnnulus, RestsAtZeroAndRisesEverywhere) {
  const GelAnnulus gel(8.8);
  EXPECT_DOUBLE_EQ(gel.pressure_kPa(0), 0);
  for (double volume_mL = -80; volume_mL < 150; volume_mL += 1) {
    EXPECT_GT(gel.stiffness_kPa_per_mL(volume_mL), 0) << volume_mL;
  }
}

TEST(GelAnnulus, StiffnessAndEnergyAreTheCurvesDerivativeAndIntegral) {
  const GelAnnulus gel(8.8);
  const double h = 1e-3;
  for (const double volume_mL : {-20.0, 0.0, 5.0, 40.0, 100.0}) {
    const double slope = (gel.pressure_kPa(volume_mL + h) - gel.pressure_kPa(volume_mL - h)) / (2 * h);
    EXPECT_NEAR(gel.stiffness_kPa_per_mL(volume_mL), slope, 1e-8);
    const double power = (gel.energy_mJ(volume_mL + h) - gel.energy_mJ(volume_mL - h)) / (2 * h);
    EXPECT_NEAR(gel.pressure_kPa(volume_mL), power, 1e-7);
  }
}

}  // namespace
}  // namespace diastole::sim_rig
