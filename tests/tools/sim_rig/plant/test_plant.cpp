#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tools/sim_rig/plant/plant.hpp"

namespace diastole::sim_rig {
namespace {

constexpr double step_mL = 0.00779165;  // one of 8 microsteps

/// Feeds the step edges of V = S/2 (1 - cos 2 pi t / T) up to `time_s`, in order.
class SinusoidalDrive {
 public:
  SinusoidalDrive(double stroke_mL, double period_s) : stroke_mL_(stroke_mL), period_s_(period_s) {}

  void feed(Plant& plant, double time_s) {
    constexpr double tick_s = 1e-5;
    for (; time_s_ < time_s; time_s_ += tick_s) {
      const double wanted_mL = stroke_mL_ / 2 * (1 - std::cos(2 * std::numbers::pi * time_s_ / period_s_));
      const long wanted = std::lround(wanted_mL / step_mL);
      if (wanted == steps_) continue;
      steps_ = wanted;
      plant.displace(time_s_, displaced_mL());
    }
  }
  [[nodiscard]] double displaced_mL() const { return static_cast<double>(steps_) * step_mL; }

 private:
  double stroke_mL_, period_s_;
  double time_s_ = 0;
  long steps_ = 0;
};

/// Ramps to `volume_mL` in one second and waits until everything is at rest.
void fill(Plant& plant, double volume_mL) {
  const auto steps = std::lround(volume_mL / step_mL);
  for (long i = 1; i <= steps; ++i) {
    plant.displace(static_cast<double>(i) / static_cast<double>(steps), static_cast<double>(i) * step_mL);
  }
  plant.advance_to(20);
}

TEST(Plant, RestsAtZero) {
  Plant plant({});
  plant.advance_to(1);
  EXPECT_EQ(plant.cavity_kPa(), 0);
  EXPECT_EQ(plant.cavity_reading_kPa(), 0);
  EXPECT_EQ(plant.pump_reading_kPa(), 0);
}

TEST(Plant, WhatThePistonDisplacesIsInTheCavityOrTheHose) {
  Plant plant({});
  fill(plant, 40);
  const double displaced_mL = static_cast<double>(std::lround(40 / step_mL)) * step_mL;
  EXPECT_NEAR(plant.cavity_mL() + plant.hose_stored_mL(), displaced_mL, 1e-9);
}

TEST(Plant, GasIsAfterManyCyclesWhatItWasAtFirst) {
  for (const bool at_pump : {true, false}) {
    PlantConfig config;
    (at_pump ? config.flaws.pump.gas_mL : config.flaws.cavity.gas_mL) = 10;
    Plant plant(config);
    SinusoidalDrive drive(40, 0.8);
    constexpr double after_16_cycles_s = 16 * 0.8;
    drive.feed(plant, after_16_cycles_s);
    ASSERT_EQ(drive.displaced_mL(), 0);
    plant.advance_to(after_16_cycles_s + 60);  // a bubble and a hose swing long
    EXPECT_NEAR(plant.cavity_kPa(), 0, 1e-4) << (at_pump ? "at the pump" : "in the cavity");
  }
}

TEST(Plant, HeldVolumeEndsOnTheGelsStaticCurve) {
  PlantConfig config;
  Plant plant(config);
  fill(plant, 40);
  const GelAnnulus gel(config.C1_kPa);
  EXPECT_NEAR(plant.cavity_kPa(), gel.pressure_kPa(40 - plant.hose_stored_mL()), 2e-3);
  EXPECT_NEAR(plant.pump_end_kPa(), plant.cavity_kPa(), 2e-3);
  EXPECT_NEAR(plant.cavity_reading_kPa(), plant.cavity_kPa(), 40.0 / 4096);
}

TEST(Plant, ThePistonsWorkIsStoredOrSpentOnFriction) {
  const PlantConfig config;
  Plant plant(config);
  const Hose hose(config.hose);
  SinusoidalDrive drive(40, 1.2);
  const GelAnnulus gel(config.C1_kPa);
  const double area_m2 = std::numbers::pi / 4 * 0.012 * 0.012;
  double work_mJ = 0;  // done by the piston on the line
  double steady_loss_mJ = 0;
  double largest_stored_mJ = 0;
  for (int i = 1; i * plant.step_s() <= 4 * 1.2; ++i) {
    const double time_s = i * plant.step_s();
    drive.feed(plant, time_s);
    plant.advance_to(time_s + 1e-9);
    work_mJ += plant.step_s() * plant.pump_end_kPa() * plant.pump_flow_mL_s();
    const double flow_mL_s = plant.cavity_flow_mL_s();
    const double speed_m_s = std::abs(flow_mL_s) * 1e-6 / area_m2;
    const double drop_kPa = 5 * std::abs(hose.steady_friction_kPa_per_m(flow_mL_s)) +
                            0.5 * config.minor_loss_K * 1005 * speed_m_s * speed_m_s / 1000;
    steady_loss_mJ += plant.step_s() * drop_kPa * std::abs(flow_mL_s);
    const double stored_mJ = gel.energy_mJ(plant.cavity_mL());
    largest_stored_mJ = std::max(largest_stored_mJ, stored_mJ);
    ASSERT_GE(work_mJ, stored_mJ - 1) << "at " << time_s << " s";
  }
  EXPECT_NEAR(largest_stored_mJ, gel.energy_mJ(40), 0.05 * gel.energy_mJ(40));
  EXPECT_GT(work_mJ, steady_loss_mJ);
  EXPECT_LT(work_mJ, 1.1 * steady_loss_mJ);  // the rest is unsteady friction, wall creep, and ringing
}

TEST(Plant, AccelerationAppearsAtThePumpAsTheHosesInertance) {
  Plant plant({});
  SinusoidalDrive drive(40, 1.2);
  double sum_kPa = 0;
  int count = 0;  // over one period of the line's own resonance (20 Hz) about the least volume
  for (double time_s = 0.001; time_s < 6.0255; time_s += 0.001) {
    drive.feed(plant, time_s);
    plant.advance_to(time_s);
    if (time_s < 5.9755) continue;
    sum_kPa += plant.pump_end_kPa() - plant.cavity_kPa();
    ++count;
  }
  const double inertance_kPa_s2_per_mL = 1005 * 5 / (std::numbers::pi / 4 * 0.012 * 0.012) * 1e-9;
  const double peak_acceleration_mL_s2 = 20 * std::pow(2 * std::numbers::pi / 1.2, 2);
  EXPECT_NEAR(sum_kPa / count, inertance_kPa_s2_per_mL * peak_acceleration_mL_s2, 1.0);
}

std::vector<double> cavity_trace_kPa(int segments) {
  PlantConfig config;
  config.hose.segments = segments;
  config.cavity.bits = 0;
  Plant plant(config);
  SinusoidalDrive drive(40, 1.2);
  std::vector<double> trace;
  for (double time_s = 0.01; time_s < 2.4; time_s += 0.01) {
    drive.feed(plant, time_s);
    plant.advance_to(time_s);
    trace.push_back(plant.cavity_reading_kPa());
  }
  return trace;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

TEST(Plant, ConvergesAsTheStepShrinks) {
  const auto reference = cavity_trace_kPa(160);
  const double coarse_kPa = largest_difference(cavity_trace_kPa(20), reference);
  const double fine_kPa = largest_difference(cavity_trace_kPa(40), reference);
  EXPECT_LT(coarse_kPa, 0.015);
  EXPECT_LT(fine_kPa, 0.7 * coarse_kPa);
}

TEST(Plant, ReadingsDoNotDependOnHowOftenItIsAsked) {
  PlantConfig config;
  config.cavity.noise_kPa = 0.03;
  Plant often(config);
  Plant sparse(config);
  SinusoidalDrive drive_often(40, 1.2);
  SinusoidalDrive drive_sparse(40, 1.2);
  for (int i = 1; i <= 1000; ++i) {
    drive_often.feed(often, i * 0.001);
    often.advance_to(i * 0.001);
  }
  drive_sparse.feed(sparse, 1.0);
  sparse.advance_to(1.0);
  EXPECT_EQ(often.cavity_reading_kPa(), sparse.cavity_reading_kPa());
}

}  // namespace
}  // namespace diastole::sim_rig
