#pragma once
// The rig without its electronics: piston, hose, gel phantom, catheter and transducers, as one initial-value
// problem.
//
//   step edges -> Screw -> Piston -> flow -> Hose -> flow -> cavity (dV/dt = Q, p = gel(V)) -> Sensor "cavity"
//                                             |-> pressure at the pump's end -----------------> Sensor "pump"
//
// It moves in fixed steps (hose segment / wave speed, 0.625 ms by default) whatever the times that are asked
// for, so the same edges and seed give the same readings. Rest pressure is zero. It shares no code with the
// estimator.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "tools/sim_rig/plant/flaws.hpp"
#include "tools/sim_rig/plant/hose.hpp"
#include "tools/sim_rig/plant/piston.hpp"
#include "tools/sim_rig/plant/screw.hpp"
#include "tools/sim_rig/plant/sensor.hpp"
#include "tools/sim_rig/plant/specimen.hpp"

namespace diastole::sim_rig {

/// An air bubble: its volume V falls as the absolute pressure rises, at constant temperature (Boyle, n = 1) or faster
/// than heat goes through its surface (n up to 1.4),
///
///   V(p) = V_rest (p_a / (p_a + p))^(1/n),   p_a = 101.325 kPa
///
/// so beside the gel it is a compliance of -dV/dp and takes its share of what the piston displaces.
struct AirBubble {
  double rest_mL = 0;  ///< at rest pressure
  double exponent = 1;

  static constexpr double atmospheric_kPa = 101.325;
  static constexpr double vapour_kPa =
      2.3;  ///< of water at 20 degC: below, gas no longer follows the pressure

  [[nodiscard]] double volume_mL(double pressure_kPa) const {
    const double absolute_kPa = std::max(atmospheric_kPa + pressure_kPa, vapour_kPa);
    const double below_kPa = absolute_kPa - (atmospheric_kPa + pressure_kPa);
    return rest_mL * std::pow(atmospheric_kPa / absolute_kPa, 1 / exponent) +
           compliance_mL_per_kPa(pressure_kPa) * below_kPa;
  }
  [[nodiscard]] double compliance_mL_per_kPa(double pressure_kPa) const {
    if (rest_mL == 0) return 0;
    const double absolute_kPa = std::max(atmospheric_kPa + pressure_kPa, vapour_kPa);
    if (exponent == 1) return rest_mL * atmospheric_kPa / (absolute_kPa * absolute_kPa);
    return rest_mL / exponent * std::pow(atmospheric_kPa / absolute_kPa, 1 / exponent) / absolute_kPa;
  }
};

struct PlantConfig {
  HoseConfig hose;
  double minor_loss_K = 1.5;  ///< at the cannula: K rho u^2 / 2 in the hose's bore
  double C1_kPa = 8.8;
  double piston_lag_ms = 2;
  SensorConfig cavity{};
  SensorConfig pump{.f0_Hz = 200, .zeta = 0.7, .range_kPa = 100};
  Flaws flaws{};  ///< those of the sensors go to `cavity` and `pump` when the plant is made
  uint64_t seed = 1;
};

class Plant {
 public:
  explicit Plant(const PlantConfig& config)
      : minor_loss_K_(config.minor_loss_K),
        hose_(config.hose),
        specimen_(config.C1_kPa, config.flaws.specimen, config.flaws.own),
        screw_(config.flaws.drive, config.seed),
        piston_(config.piston_lag_ms, hose_.step_s()),
        cavity_sensor_(with_flaws(config.cavity, config.flaws, true), hose_.step_s(), 2 * config.seed),
        pump_sensor_(with_flaws(config.pump, config.flaws, false), hose_.step_s(), 2 * config.seed + 1),
        loss_kPa_s2_per_mL2_(loss_factor(config)),
        pump_gas_{config.flaws.pump.gas_mL, gas_exponent},
        pump_compliance_mL_per_kPa_(config.flaws.pump.compliance_mL_per_kPa),
        pump_leak_mL_s_kPa_(config.flaws.pump.leak_mL_s_kPa),
        own_(config.flaws.own),
        cavity_flaws_(config.flaws.cavity),
        leak_mL_s_kPa_(cavity_flaws_.leak_mL_s_kPa),
        bubble_{cavity_flaws_.gas_mL, gas_exponent} {}

  /// The controller has displaced `volume_mL` in all since `time_s` (not before the plant's present).
  void displace(double time_s, double volume_mL) {
    const double piston_mL = own_.piston_mL ? own_.piston_mL(volume_mL, since_first_cycle_s()) : volume_mL;
    piston_.displace(time_s, screw_.follow(piston_mL));
  }
  /// The controller's TTL has risen.
  void begin_cycle() {
    if (first_cycle_step_ < 0) first_cycle_step_ = step_count_;
    screw_.begin_cycle();
    specimen_.begin_cycle();
    cavity_sensor_.begin_cycle();
    pump_sensor_.begin_cycle();
  }

  /// Moves to `time_s`; every edge up to then must have been handed over.
  void advance_to(double time_s) {
    while (static_cast<double>(step_count_ + 1) * step_s() <= time_s)
      step();
    since_step_s_ = time_s - static_cast<double>(step_count_) * step_s();
  }

  /// What the transducers show now (at the last advance_to).
  [[nodiscard]] double cavity_reading_kPa() const { return cavity_sensor_.reading_kPa(since_step_s_); }
  [[nodiscard]] double pump_reading_kPa() const { return pump_sensor_.reading_kPa(since_step_s_); }

  /// What goes wrong from the next step on; neutral values make it whole again.
  /// At the cavity, through a cannula that does not seal: outflow in proportion to the pressure (a narrow slit, laminar);
  /// under suction it draws in as much.
  void leak(double conductance_mL_s_kPa) { leak_mL_s_kPa_ = conductance_mL_s_kPa; }
  /// The hose is kinked or clamped at the cannula so that a share f > 0 of its area is left: the jet behind it loses its
  /// speed, K = (1/f - 1)^2 on the dynamic pressure of the open bore (Borda and Carnot).
  void block(double open_share) { blockage_K_ = (1 / open_share - 1) * (1 / open_share - 1); }
  /// It comes in, or goes, at the pressure of the moment, and moves only with what follows.
  void admit(const AirBubble& bubble) {
    bubble_ = bubble;
    bubble_owes_mL_ = 0;
  }
  [[nodiscard]] Sensor& cavity_sensor() { return cavity_sensor_; }

  /// The truth at the last whole step.
  [[nodiscard]] double cavity_kPa() const { return specimen_.pressure_kPa(cavity_mL_); }
  [[nodiscard]] double cavity_mL() const { return cavity_mL_; }
  [[nodiscard]] double cavity_flow_mL_s() const { return outlet_flow_mL_s_; }
  [[nodiscard]] double pump_end_kPa() const { return hose_.pump_end_kPa(); }
  [[nodiscard]] double pump_flow_mL_s() const { return piston_.flow_mL_s(); }
  [[nodiscard]] double hose_stored_mL() const { return hose_.stored_mL(); }
  [[nodiscard]] double step_s() const { return hose_.step_s(); }

 private:
  static double loss_factor(const PlantConfig& config) {
    const double area_m2 = std::numbers::pi / 4 * config.hose.bore_mm * config.hose.bore_mm * 1e-6;
    constexpr double m3_per_mL = 1e-6;
    constexpr double kPa_per_Pa = 1e-3;
    return 0.5 * config.hose.fluid_density_kg_m3 / (area_m2 * area_m2) * m3_per_mL * m3_per_mL * kPa_per_Pa;
  }

  static constexpr double gas_exponent = 1.2;  // between constant temperature and no exchange of heat

  /// The sensor with the flaws that concern it.
  static SensorConfig with_flaws(SensorConfig sensor, const Flaws& flaws, bool at_cavity) {
    sensor.flaws = flaws.sensors;
    if (at_cavity) sensor.own_kPa = flaws.own.seen_kPa;
    if (!at_cavity) sensor.flaws.gain = sensor.flaws.step_kPa = sensor.flaws.drift_kPa_s = 0;
    return sensor;
  }

  void step() {
    const double cavity_before_kPa = cavity_kPa();
    const double pump_before_kPa = pump_end_kPa();
    piston_.advance();
    take_disturbances();
    const double flow_mL_s = solve_outlet_flow_mL_s();
    hose_.advance(entering_flow_mL_s(), flow_mL_s);
    const double gel_mL = gel_inflow_mL(flow_mL_s);
    cavity_mL_ += gel_mL;
    outlet_flow_mL_s_ = flow_mL_s;
    specimen_.pass(cavity_mL_, step_s());
    pump_gas_owes_mL_ =
        owed_mL(pump_gas_, pump_before_kPa, pump_end_kPa(),
                pump_gas_.compliance_mL_per_kPa(pump_before_kPa) * (pump_end_kPa() - pump_before_kPa));
    bubble_owes_mL_ = owed_mL(bubble_, cavity_before_kPa, cavity_kPa(), (1 / gel_share_ - 1) * gel_mL);
    ++step_count_;
    cavity_sensor_.advance(0.5 * (cavity_before_kPa + cavity_kPa()));
    pump_sensor_.advance(0.5 * (pump_before_kPa + pump_end_kPa()));
  }
  /// The flow into the cavity at the step's end, from the hose's characteristic, cannula loss and gel.
  [[nodiscard]] double solve_outlet_flow_mL_s() const {
    const Characteristic line = hose_.outlet();
    const double kink_K = cavity_mL_ > cavity_flaws_.kink_above_mL ? cavity_flaws_.kink_K : 0;
    const double loss_kPa_s2_per_mL2 = loss_kPa_s2_per_mL2_ * (minor_loss_K_ + blockage_K_ + kink_K);
    double flow = outlet_flow_mL_s_;
    const double half_step_s = 0.5 * step_s() * gel_share_;
    // Newton on a strictly increasing residual that is nearly linear (the line's impedance dominates).
    for (int iteration = 0; iteration < 20; ++iteration) {
      const double volume_mL = cavity_mL_ + gel_inflow_mL(flow);
      const double residual = specimen_.pressure_kPa(volume_mL) +
                              loss_kPa_s2_per_mL2 * flow * std::abs(flow) +
                              line.impedance_kPa_s_per_mL * flow - line.pressure_kPa;
      const double slope = specimen_.stiffness_kPa_per_mL(volume_mL) * half_step_s +
                           2 * loss_kPa_s2_per_mL2 * std::abs(flow) + line.impedance_kPa_s_per_mL;
      const double change = residual / slope;
      flow -= change;
      if (std::abs(change) < 1e-12) break;
    }
    return flow;
  }
  /// What of the piston's flow enters the hose, beside gas and leak at the pump.
  [[nodiscard]] double entering_flow_mL_s() const {
    const double compliance_flow_mL_s_kPa =
        (pump_compliance_mL_per_kPa_ + pump_gas_.compliance_mL_per_kPa(pump_end_kPa())) / step_s();
    const double loses = pump_leak_mL_s_kPa_;
    if (compliance_flow_mL_s_kPa == 0 && loses == 0 && !own_.pump_leak_mL_s) return piston_.flow_mL_s();
    // p = line.p + z Q and Q = Q_piston - C (p - p_before) / dt - G p.
    const Characteristic line = hose_.inlet();
    const double z = line.impedance_kPa_s_per_mL;
    const double without_kPa = line.pressure_kPa + z * (piston_.flow_mL_s() + pump_gas_owes_mL_ / step_s() +
                                                        compliance_flow_mL_s_kPa * pump_end_kPa());
    const double share = 1 + z * (compliance_flow_mL_s_kPa + loses);
    double pressure_kPa = without_kPa / share;
    if (own_.pump_leak_mL_s) pressure_kPa = behind_own_leak_kPa(without_kPa, share, z);
    return (pressure_kPa - line.pressure_kPa) / z;
  }
  /// share p + z L(p) = without, by Newton's method with differences: L grows with p.
  [[nodiscard]] double behind_own_leak_kPa(double without_kPa, double share, double z) const {
    constexpr double small_kPa = 1e-4;
    const auto excess = [&](double p) {
      return share * p + z * own_.pump_leak_mL_s(p, since_first_cycle_s()) - without_kPa;
    };
    double p = pump_end_kPa();
    for (int iteration = 0; iteration < 30; ++iteration) {
      const double change = 2 * small_kPa * excess(p) / (excess(p + small_kPa) - excess(p - small_kPa));
      p -= change;
      if (std::abs(change) < 1e-9) break;
    }
    return p;
  }
  [[nodiscard]] double since_first_cycle_s() const {
    return first_cycle_step_ < 0 ? 0 : static_cast<double>(step_count_ - first_cycle_step_) * step_s();
  }

  /// A step squeezes a gas by what its compliance at the step's beginning gives. What it then holds more than that is
  /// pressed out in the next step, so that nothing gathers over the cycles.
  static double owed_mL(const AirBubble& gas, double before_kPa, double after_kPa, double squeezed_mL) {
    if (gas.rest_mL == 0) return 0;
    return gas.volume_mL(after_kPa) - (gas.volume_mL(before_kPa) - squeezed_mL);
  }
  /// The leak's flow and the bubble's share are those of the step's beginning: both change little in half a millisecond.
  void take_disturbances() {
    leaked_mL_ = leak_mL_s_kPa_ * cavity_kPa() * step_s();
    if (own_.cavity_leak_mL_s)
      leaked_mL_ += own_.cavity_leak_mL_s(cavity_kPa(), since_first_cycle_s()) * step_s();
    gel_share_ =
        1 / (1 + bubble_.compliance_mL_per_kPa(cavity_kPa()) * specimen_.stiffness_kPa_per_mL(cavity_mL_));
  }
  /// Volume that enters the gel in a step with this flow at its end, beside bubble and leak.
  [[nodiscard]] double gel_inflow_mL(double flow_mL_s) const {
    return gel_share_ * (0.5 * step_s() * (outlet_flow_mL_s_ + flow_mL_s) - leaked_mL_ + bubble_owes_mL_);
  }

  double minor_loss_K_;
  Hose hose_;
  Specimen specimen_;
  Screw screw_;
  Piston piston_;
  Sensor cavity_sensor_;
  Sensor pump_sensor_;
  double loss_kPa_s2_per_mL2_;  // for K = 1
  long step_count_ = 0;
  double since_step_s_ = 0;
  AirBubble pump_gas_;
  double pump_gas_owes_mL_ = 0;
  double pump_compliance_mL_per_kPa_;
  double pump_leak_mL_s_kPa_;
  OwnLaws own_;
  long first_cycle_step_ = -1;
  CavityFlaws cavity_flaws_;
  double leak_mL_s_kPa_;
  double blockage_K_ = 0;
  AirBubble bubble_;
  double bubble_owes_mL_ = 0;
  double leaked_mL_ = 0;  // in this step
  double gel_share_ = 1;  // of a change of the cavity's volume; the bubble gives way for the rest
  double cavity_mL_ = 0;  // of the gel; the bubble's share is not in it
  double outlet_flow_mL_s_ = 0;
};

}  // namespace diastole::sim_rig
