#include "estimator/rig/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace diastole::rig {
namespace {

constexpr double stiffness_kPa_per_mL = 0.1;

RigModel straight_model() {
  RigModel model;
  model.modulus_kPa = 1.0;
  model.curve = SpecimenCurve({{-10.0, -10.0 * stiffness_kPa_per_mL, stiffness_kPa_per_mL},
                               {50.0, 50.0 * stiffness_kPa_per_mL, stiffness_kPa_per_mL}});
  return model;
}

RunDrive cycles(int count) {
  std::vector<Stroke> strokes;
  RunDrive run;
  for (int cycle = 0; cycle < count; ++cycle) {
    const double start = 0.5 + 1.2 * cycle;
    strokes.push_back({start, start + 0.6, 0.0, 40.0});
    strokes.push_back({start + 0.6, start + 1.2, 40.0, 0.0});
    run.place.trigger_s.push_back(start);
  }
  run.motion = Motion(strokes, 0.0, 0.05);
  run.end_s = 0.5 + 1.2 * count + 2.0;
  return run;
}

RunDrive ramp(double to_mL, double end_s) {
  RunDrive run;
  run.motion = Motion({{0.5, 1.5, 0.0, to_mL, 0.2}}, 0.0, 0.05);
  run.end_s = end_s;
  return run;
}

double cavity_kPa_at(const PlantTrace& trace, double time_s) {
  return trace.cavity_kPa[static_cast<size_t>(std::lround((time_s - trace.start_s) / trace.step_s))];
}

TEST(Simulation, KeepsVolume) {
  const RigModel model = straight_model();
  const PlantTrace trace = simulate_plant(model, ramp(30.0, 20.0));
  const double pressure = trace.cavity_kPa.back();
  const double kept_mL = model.hose.compliance_mL_per_kPa() * (1.0 + model.hose.creep_fraction) * pressure;
  EXPECT_NEAR(trace.cavity_mL.back() + kept_mL, 30.0, 1e-5);
  EXPECT_NEAR(trace.pump_kPa.back(), pressure, 1e-4);
  EXPECT_NEAR(pressure, stiffness_kPa_per_mL * trace.cavity_mL.back(), 1e-9);
}

TEST(Simulation, TheScrewTurnsBeforeItErrs) {
  RigModel model = straight_model();
  // The drive's error, added first, depends on how far the screw turned: half of what was commanded.
  model.drive.emplace_back([](DriveTrace& trace, const RunPlace&) {
    for (double& volume : trace.volume_mL)
      volume += 0.1 * volume * volume / 30.0;
    trace.differentiate();
  });
  model.turns.emplace_back([](DriveTrace& trace, const RunPlace&) {
    for (auto* series : {&trace.volume_mL, &trace.flow_mL_per_s, &trace.acceleration_mL_per_s2})
      for (double& value : *series)
        value *= 0.5;
  });
  const PlantTrace trace = simulate_plant(model, ramp(30.0, 20.0));
  const double kept_mL =
      model.hose.compliance_mL_per_kPa() * (1.0 + model.hose.creep_fraction) * trace.cavity_kPa.back();
  EXPECT_NEAR(trace.cavity_mL.back() + kept_mL, 15.0 + 0.75, 1e-5);
}

TEST(Simulation, ConvergesInStepAndComponents) {
  const RigModel model = straight_model();
  const RunDrive run = cycles(2);
  const PlantTrace coarse = simulate_plant(model, run);
  const PlantTrace fine = simulate_plant(model, run, {.step_s = 1.0 / 2400.0, .components = 6});
  double pump = 0.0;
  double cavity = 0.0;
  for (size_t k = 0; k + 2 < coarse.pump_kPa.size(); ++k) {
    pump += std::pow(coarse.pump_kPa[k] - fine.pump_kPa[4 * k], 2);
    cavity = std::max(cavity, std::abs(coarse.cavity_kPa[k] - fine.cavity_kPa[4 * k]));
  }
  EXPECT_LT(std::sqrt(pump / static_cast<double>(coarse.pump_kPa.size())), 0.015);  // of +-30 kPa
  EXPECT_LT(cavity, 0.002);
}

TEST(Simulation, AThrottledSoftHoseStaysStableInLongSteps) {
  RigModel model = straight_model();
  model.hose.wave_speed_m_s = 60.0;
  model.hose.loss_coefficient = 240.0;
  const RunDrive run = cycles(2);
  const PlantTrace coarse = simulate_plant(model, run, {.step_s = 1.0 / 300.0});
  const PlantTrace fine = simulate_plant(model, run, {.step_s = 1.0 / 2400.0});
  for (double time_s = 0.5; time_s < 3.0; time_s += 0.1)
    EXPECT_NEAR(cavity_kPa_at(coarse, time_s), cavity_kPa_at(fine, time_s), 0.01) << time_s;
}

TEST(Simulation, ASlowLineConvergesInComponents) {
  RigModel model = straight_model();
  model.hose.wave_speed_m_s = 16.0;
  model.hose.loss_coefficient = 100.0;
  const RunDrive run = cycles(3);
  const PlantTrace usual = simulate_plant(model, run);
  const PlantTrace more = simulate_plant(model, run, {.components = 8});
  for (double time_s = 0.5; time_s < 4.0; time_s += 0.1)
    EXPECT_NEAR(cavity_kPa_at(usual, time_s), cavity_kPa_at(more, time_s), 0.01) << time_s;  // of 3 kPa
}

TEST(Simulation, ALeakEmptiesTheCavityAsResistanceAndCompliance) {
  RigModel model = straight_model();
  const double conductance = 1.0;  // mL/(s kPa)
  model.cavity_leaks.emplace_back([=](const RunPlace&) {
    return [=](double pressure_kPa, double) { return conductance * pressure_kPa; };
  });
  const PlantTrace trace = simulate_plant(model, ramp(30.0, 15.0));
  const size_t early = static_cast<size_t>(4.0 / trace.step_s);
  const size_t late = static_cast<size_t>(12.0 / trace.step_s);
  const double time_s = 1.0 / (stiffness_kPa_per_mL * conductance);
  EXPECT_NEAR(trace.cavity_kPa[late] / trace.cavity_kPa[early], std::exp(-8.0 / time_s), 2e-3);
}

double pump_rms_kPa(const PlantTrace& a, const PlantTrace& b, size_t steps_of_b) {
  double square = 0.0;
  for (size_t k = 0; k + 2 < a.pump_kPa.size(); ++k)
    square += std::pow(a.pump_kPa[k] - b.pump_kPa[steps_of_b * k], 2);
  return std::sqrt(square / static_cast<double>(a.pump_kPa.size()));
}

/// A leak past the seal; it opens with pressure if `bend` is not 0.
RigModel leaking_model(double bend) {
  constexpr double conductance = 0.04;  // mL/(s kPa)
  RigModel model = straight_model();
  model.pump_leak_mL_s_kPa = conductance;
  if (bend != 0.0)
    model.pump_leaks.emplace_back([=](const RunPlace&) {
      return [=](double p, double) { return conductance * bend * p * std::abs(p) / 10.0; };
    });
  return model;
}

TEST(Simulation, ADriveThatHardlyYieldsLeaksAsARigidOne) {
  RigModel model = leaking_model(0.0);
  const PlantTrace rigid = simulate_plant(model, cycles(2));
  model.drive_compliance_mL_per_kPa = 1.1e-5;
  EXPECT_LT(pump_rms_kPa(simulate_plant(model, cycles(2)), rigid, 1),
            0.1);  // of +-50 kPa, a third of it by the ringing that it changes without a leak, too
}

TEST(Simulation, ADriveThatYieldsLessAndLessBecomesARigidOne) {
  RigModel model = straight_model();
  const PlantTrace rigid = simulate_plant(model, cycles(2));
  const auto off_kPa = [&](double compliance_mL_per_kPa) {
    model.drive_compliance_mL_per_kPa = compliance_mL_per_kPa;
    return pump_rms_kPa(simulate_plant(model, cycles(2)), rigid, 1);
  };
  EXPECT_NEAR(off_kPa(1e-6) / off_kPa(1e-5), 0.1, 0.01);
  EXPECT_LT(off_kPa(1.1e-8), 1e-3);  // of +-50 kPa; the next is taken for rigid
  EXPECT_EQ(off_kPa(0.9e-8), 0.0);
}

/// The pump's pressure errs by less than this in the usual step, and by a quarter in half of it.
void expect_second_order(const RigModel& model, double most_kPa) {
  const PlantTrace fine = simulate_plant(model, cycles(2), {.step_s = 1.0 / 4800.0});
  const double coarse_kPa = pump_rms_kPa(simulate_plant(model, cycles(2)), fine, 8);
  const double half_kPa = pump_rms_kPa(simulate_plant(model, cycles(2), {.step_s = 1.0 / 1200.0}), fine, 4);
  EXPECT_LT(coarse_kPa, most_kPa);  // of +-50 kPa
  EXPECT_LT(half_kPa, 0.4 * coarse_kPa);
}

TEST(Simulation, ALeakPastAYieldingDriveConvergesInStep) {
  for (const double bend : {0.0, 1.0}) {
    SCOPED_TRACE(bend);
    RigModel model = leaking_model(bend);
    model.drive_compliance_mL_per_kPa = 0.00035;
    expect_second_order(model, 0.2);
  }
}

/// Whatever yields beside it: what opens takes the place of nearly all that a shut end makes.
TEST(Simulation, ALeakThatOpensConvergesInStep) {
  for (const double compliance_mL_per_kPa : {0.0, 1e-6, 0.00035}) {
    SCOPED_TRACE(compliance_mL_per_kPa);
    RigModel model = straight_model();
    model.drive_compliance_mL_per_kPa = compliance_mL_per_kPa;
    model.pump_leaks.emplace_back(
        [](const RunPlace&) { return [](double p, double) { return 0.05 * std::max(p - 5.0, 0.0); }; });
    const PlantTrace coarse = simulate_plant(model, cycles(2));
    const PlantTrace fine = simulate_plant(model, cycles(2), {.step_s = 1.0 / 2400.0});
    EXPECT_LT(pump_rms_kPa(coarse, fine, 4), 0.02);  // of +-50 kPa
  }
}

TEST(Simulation, ALeakThatShutsAtOnceLeavesAFinitePressure) {
  RigModel model = straight_model();
  model.pump_leaks.emplace_back(
      [](const RunPlace&) { return [](double p, double time_s) { return time_s < 1.0 ? 0.05 * p : 0.0; }; });
  const PlantTrace trace = simulate_plant(model, cycles(2));
  // Half a millilitre a second that stops at once is a few kPa in a hose, and more where the piston stands still.
  EXPECT_LT(std::ranges::max(trace.pump_kPa), 200.0);
  EXPECT_GT(std::ranges::min(trace.pump_kPa), -200.0);
}

TEST(Simulation, GasConvergesInStep) {
  RigModel model = straight_model();
  model.pump_gas_mL = 1.0;
  model.cavity_gas_mL = 5.0;
  const RunDrive run = cycles(1);
  const PlantTrace coarse = simulate_plant(model, run);
  const PlantTrace fine = simulate_plant(model, run, {.step_s = 1.0 / 2400.0});
  double square = 0.0;
  for (size_t k = 0; k + 1 < coarse.cavity_kPa.size(); ++k) {
    EXPECT_NEAR(coarse.cavity_kPa[k], fine.cavity_kPa[4 * k], 0.003);
    square += std::pow(coarse.pump_kPa[k] - fine.pump_kPa[4 * k], 2);
  }
  EXPECT_LT(std::sqrt(square / static_cast<double>(coarse.pump_kPa.size())), 0.05);  // of +-50 kPa
}

TEST(Simulation, GasAndAYieldingDriveConvergeInStep) {
  for (const bool leaks : {false, true}) {
    SCOPED_TRACE(leaks);
    RigModel model = leaks ? leaking_model(1.0) : straight_model();
    model.pump_gas_mL = 0.5;
    model.drive_compliance_mL_per_kPa = 0.003;
    expect_second_order(model, 0.1);
  }
}

TEST(Simulation, GasAtThePumpAndTheDriveBothTakeTheirShareOfTheVolume) {
  RigModel model = straight_model();
  model.pump_gas_mL = 2.0;
  model.drive_compliance_mL_per_kPa = 0.02;
  const PlantTrace trace = simulate_plant(model, ramp(30.0, 20.0));
  const double pressure = trace.pump_kPa.back();
  const double squeezed = 2.0 * (1.0 - std::pow(1.0 + pressure / 101.325, -1.0 / model.gas_exponent));
  const double kept_mL = model.hose.compliance_mL_per_kPa() * (1.0 + model.hose.creep_fraction) * pressure;
  EXPECT_NEAR(trace.cavity_mL.back() + kept_mL + squeezed + 0.02 * pressure, 30.0, 1e-5);
}

TEST(Simulation, LessAndLessGasBesideADriveThatYieldsBecomesNone) {
  RigModel model = straight_model();
  model.drive_compliance_mL_per_kPa = 0.0015;
  const SimulationOptions fine = {.step_s = 1.0 / 1200.0};
  const PlantTrace none = simulate_plant(model, cycles(2), fine);
  const auto off_kPa = [&](double gas_mL) {
    model.pump_gas_mL = gas_mL;
    return pump_rms_kPa(simulate_plant(model, cycles(2)), none, 1);  // gas halves its steps
  };
  EXPECT_NEAR(off_kPa(1e-3) / off_kPa(1e-2), 0.1, 0.01);
}

TEST(Simulation, GasInTheCavityTakesItsShareOfTheVolume) {
  RigModel model = straight_model();
  model.cavity_gas_mL = 10.0;
  const PlantTrace trace = simulate_plant(model, ramp(30.0, 20.0));
  const double pressure = trace.cavity_kPa.back();
  const double squeezed = 10.0 * (1.0 - std::pow(1.0 + pressure / 101.325, -1.0 / model.gas_exponent));
  const double kept_mL = model.hose.compliance_mL_per_kPa() * (1.0 + model.hose.creep_fraction) * pressure;
  EXPECT_NEAR(trace.cavity_mL.back() + squeezed + kept_mL, 30.0, 1e-5);
}

TEST(Simulation, AllThatADriveMovesIsLateByItsLag) {
  RigModel model = straight_model();
  const RunDrive run = cycles(3);
  const std::vector<double> times{0.7, 1.3, 2.5}, later{0.7 + 0.004, 1.3 + 0.004, 2.5 + 0.004};
  const Prediction prompt = observe(model, simulate_plant(model, run), run.place, times);
  model.drive_lag_s = 0.004;
  const PlantTrace late = simulate_plant(model, run);
  const Prediction seen = observe(model, late, run.place, later);
  for (size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(seen.cavity_kPa[i], prompt.cavity_kPa[i], 1e-9);
    EXPECT_NEAR(seen.pump_kPa[i], prompt.pump_kPa[i], 1e-9);
  }
  EXPECT_DOUBLE_EQ(late.start_s, run.start_s + 0.004) << "volumes too";
}

TEST(Simulation, TheCatheterLagsByTwiceItsDampingOverItsFrequency) {
  const RigModel model = straight_model();
  PlantTrace rising;
  rising.step_s = 1.0 / 600.0;
  for (int k = 0; k < 1200; ++k)
    rising.cavity_kPa.push_back(0.001 * k);
  rising.pump_kPa = rising.cavity_kPa;
  const double lag_s = 2.0 * model.catheter.damping / (2.0 * std::acos(-1.0) * model.catheter.resonance_Hz);
  const std::vector<double> times{1.5};
  const Prediction seen = observe(model, rising, {}, times);
  EXPECT_NEAR(seen.cavity_kPa[0], 0.6 * (1.5 - lag_s), 1e-6);
  EXPECT_NEAR(seen.pump_kPa[0], 0.6 * 1.5, 1e-9);
}

}  // namespace
}  // namespace diastole::rig
