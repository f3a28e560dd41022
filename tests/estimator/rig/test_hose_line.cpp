#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "estimator/rig/hose_line.hpp"

namespace diastole::rig {
namespace {

constexpr double pi = std::numbers::pi;

Hose lossless() {
  Hose hose;
  hose.viscosity_Pa_s = 1e-12;
  hose.creep_fraction = 0.0;
  hose.brunone = 0.0;
  return hose;
}

/// Drives the pump end with a flow, keeps the far end at zero pressure; `see(time, line)` after each settled step.
template <class Flow, class See>
void drive(HoseLine& line, double step_s, double end_s, const Flow& flow, const See& see) {
  for (double t = 0.0; t < end_s; t += step_s) {
    EndLoads loads;
    loads.piston_acceleration = (flow(t + step_s) - flow(t)) / step_s;
    line.settle(loads);
    see(t, line);
    line.begin_step(loads, flow(t + step_s));
    line.end_step(loads);
  }
}

TEST(HoseLine, AStepOfFlowMakesJoukowskysPressure) {
  const Hose hose = lossless();
  const double step_s = 5e-5;
  HoseLine line(hose, {.step_s = step_s, .components = 60});
  const double flow_mL_per_s = 10.0;
  const double hammer_kPa =
      hose.density_kg_m3 * hose.wave_speed_m_s * flow_mL_per_s / hose.area_mm2() * 1e-3;  // rho c v
  double first = 0.0;
  double second = 0.0;
  const double there_and_back_s = 2.0 * hose.length_m / hose.wave_speed_m_s;
  drive(
      line, step_s, 2.0 * there_and_back_s, [&](double t) { return flow_mL_per_s * std::min(t / 2e-3, 1.0); },
      [&](double t, const HoseLine& at) {
        const double phase = t / there_and_back_s;
        if (phase > 0.2 && phase < 0.9) first += at.pump_kPa() * step_s / (0.7 * there_and_back_s);
        if (phase > 1.2 && phase < 1.9) second += at.pump_kPa() * step_s / (0.7 * there_and_back_s);
      });
  EXPECT_NEAR(first, hammer_kPa, 0.01 * hammer_kPa);
  EXPECT_NEAR(second, -hammer_kPa, 0.01 * hammer_kPa);
}

TEST(HoseLine, RingsAtAQuarterWave) {
  const Hose hose = lossless();
  HoseLine line(hose, {.step_s = 1.0 / 600.0, .components = 4});
  int crossings = 0;
  double before = 0.0;
  drive(
      line, 1.0 / 600.0, 10.0, [](double t) { return 10.0 * std::min(t / 2e-3, 1.0); },
      [&](double, const HoseLine& at) {
        if (before < 0.0 && at.kept_mL() >= 0.0) ++crossings;
        before = at.kept_mL();
      });
  EXPECT_NEAR(crossings / 10.0, hose.wave_speed_m_s / (4.0 * hose.length_m), 0.2);
}

TEST(HoseLine, KeepsEnergyButForDragAndCreep) {
  const Hose hose;
  const double step_s = 1.0 / 4800.0;
  HoseLine line(hose, {.step_s = step_s, .components = 4});
  double worked = 0.0;
  double lost = 0.0;
  double largest = 0.0;
  double balance = 0.0;
  const auto flow = [](double t) { return 100.0 * std::pow(std::sin(pi * t / 0.6), 3); };
  drive(line, step_s, 1.2, flow, [&](double t, const HoseLine& at) {
    worked += at.pump_kPa() * flow(t) * step_s;  // the far end is at zero pressure
    lost += at.loss_mW() * step_s;
    largest = std::max(largest, at.energy_mJ());
    balance = worked - lost - at.energy_mJ();
  });
  EXPECT_GT(lost, 10.0);
  EXPECT_NEAR(balance, 0.0, 2e-3 * largest);
}

/// Z = i omega rho L / A / (1 - 2 J1(x) / (x J0(x))), x = i^(3/2) alpha: J. R. Womersley, J. Physiol. 127 (1955) 553.
std::complex<double> womersley_impedance(const Hose& hose, double omega) {
  const double radius_m = 0.5e-3 * hose.bore_mm;
  const double alpha = radius_m * std::sqrt(omega * hose.density_kg_m3 / hose.viscosity_Pa_s);
  const std::complex<double> quarter(0.0, 0.25 * alpha * alpha);  // -x^2 / 4
  std::complex<double> term = 1.0, j0 = 0.0, twice_j1_over_x = 0.0;
  for (int k = 0; k < 100; ++k) {
    j0 += term;
    twice_j1_over_x += term / (k + 1.0);
    term *= quarter / ((k + 1.0) * (k + 1.0));
  }
  return std::complex<double>(0.0, omega * hose.inertance()) / (1.0 - twice_j1_over_x / j0);
}

/// Pressure at the pump by a small oscillating flow after it has settled, over it.
std::complex<double> impedance_of(const Hose& hose, double frequency_Hz, double step_s, double settling_s) {
  const double omega = 2.0 * pi * frequency_Hz;
  HoseLine line(hose, {.step_s = step_s, .components = 4});
  constexpr double periods = 2.0;
  std::complex<double> sum = 0.0;
  drive(
      line, step_s, settling_s + periods / frequency_Hz, [&](double t) { return std::sin(omega * t); },
      [&](double t, const HoseLine& at) {
        if (t >= settling_s - 0.5 * step_s) sum += at.pump_kPa() * std::polar(1.0, -omega * t);
      });
  return std::complex<double>(0.0, 2.0) * sum * step_s * frequency_Hz / periods;
}

TEST(HoseLine, SlowViscousFlowHasWomersleysResistance) {
  Hose hose;
  hose.viscosity_Pa_s = 1.0;
  hose.brunone = 0.0;
  const double exact = womersley_impedance(hose, pi).real();
  EXPECT_NEAR(impedance_of(hose, 0.5, 1.0 / 600.0, 4.0).real(), exact, 0.01 * exact);
}

TEST(HoseLine, ABoundaryLayerThatRemembersMakesWomersleysImpedance) {
  Hose steady;
  steady.wave_speed_m_s = 20'000.0;  // nothing but inertia and friction
  steady.brunone = 0.0;
  Hose unsteady = steady;
  unsteady.zielke = 1.0;
  const double radius_m = 0.5e-3 * steady.bore_mm;
  const double poiseuille =
      8.0 * steady.viscosity_Pa_s * steady.length_m / (pi * std::pow(radius_m, 4)) * 1e-9;  // kPa s/mL
  for (const double frequency_Hz : {0.5, 1.0, 2.0}) {
    const double omega = 2.0 * pi * frequency_Hz;
    const std::complex<double> exact =
        womersley_impedance(steady, omega) - std::complex<double>(poiseuille, omega * steady.inertance());
    // A step of the simulated rig errs by what it turns in; a sixth of it by a tenth of that.
    for (const auto& [step_s, part] : {std::pair{1.0 / 600.0, 0.005}, {1.0 / 100.0, 0.05}}) {
      const std::complex<double> found = impedance_of(unsteady, frequency_Hz, step_s, 80.0) -
                                         impedance_of(steady, frequency_Hz, step_s, 80.0);
      EXPECT_LT(std::abs(found - exact), part * std::abs(exact))
          << frequency_Hz << " Hz, steps of " << step_s << " s: " << found << ", exactly " << exact;
    }
  }
}

TEST(HoseLine, SwingsAgainstAGasAsInertanceAndCompliance) {
  Hose hose = lossless();
  hose.wave_speed_m_s = 3000.0;
  const double stiffness_kPa_per_mL = 20.0;
  HoseLine line(hose, {.step_s = 1.0 / 600.0, .components = 4, .pump_stiffness = stiffness_kPa_per_mL});
  int crossings = 0;
  double before = 0.0;
  const double squeezed_mL = 1.0;  // the piston is put here at once
  for (int k = 0; k < 6000; ++k) {
    EndLoads now;
    now.pump_kPa = stiffness_kPa_per_mL * squeezed_mL;
    line.settle(now);
    line.begin_step(now, 0.0);
    line.end_step(now);
    if (before < squeezed_mL && line.yielded_mL() >= squeezed_mL) ++crossings;
    before = line.yielded_mL();
  }
  const double natural_Hz = std::sqrt(stiffness_kPa_per_mL / hose.inertance()) / (2.0 * pi);
  EXPECT_NEAR(crossings / 10.0, natural_Hz, 0.1 + 0.01 * natural_Hz);
}

/// How large the swing against a gas still is in the twelfth second, mL; the piston was put 0.2 mL further in 0.1 s.
double still_swinging_mL(const Hose& hose, size_t components) {
  constexpr double stiffness_kPa_per_mL = 33.0;
  constexpr double put_mL = 0.2;
  constexpr double rate_Hz = 1200.0;
  HoseLine line(hose,
                {.step_s = 1.0 / rate_Hz, .components = components, .pump_stiffness = stiffness_kPa_per_mL});
  double largest = 0.0;
  for (int k = 0; k < 12 * static_cast<int>(rate_Hz); ++k) {
    const double part = std::min(static_cast<double>(k) / (0.1 * rate_Hz), 1.0);
    const EndLoads loads{.pump_kPa = stiffness_kPa_per_mL * put_mL * 0.5 * (1.0 - std::cos(pi * part))};
    line.settle(loads);
    line.begin_step(loads, 0.0);
    line.end_step(loads);
    if (k > 11 * static_cast<int>(rate_Hz)) largest = std::max(largest, std::abs(line.yielded_mL() - put_mL));
  }
  return largest;
}

TEST(HoseLine, FastWavesDoNotDampTheSlowSwing) {
  Hose hose;
  const double alone = still_swinging_mL(hose, 1);
  EXPECT_GT(alone, 0.01);
  for (const size_t components : {2U, 4U, 8U})
    EXPECT_NEAR(still_swinging_mL(hose, components), alone, 0.2 * alone) << components;  // after 47 swings
  hose.wall_loss_s = 0.0;  // then the unsteady friction feeds them, and they it
  EXPECT_LT(still_swinging_mL(hose, 8), 0.5 * alone);
}

}  // namespace
}  // namespace diastole::rig
