#include "tools/sim_rig/plant/plant.hpp"

#include <cmath>
#include <numbers>

namespace diastole::sim_rig {
namespace {

double loss_factor(const PlantConfig& config) {
  const double area_m2 = std::numbers::pi / 4 * config.hose.bore_mm * config.hose.bore_mm * 1e-6;
  constexpr double m3_per_mL = 1e-6;
  constexpr double kPa_per_Pa = 1e-3;
  return 0.5 * config.hose.fluid_density_kg_m3 / (area_m2 * area_m2) * m3_per_mL * m3_per_mL * kPa_per_Pa;
}

constexpr double gas_exponent = 1.2;  // between constant temperature and no exchange of heat

/// The sensor with the flaws that concern it.
SensorConfig with_flaws(SensorConfig sensor, const SensorFlaws& flaws, bool at_cavity) {
  sensor.flaws = flaws;
  if (!at_cavity) sensor.flaws.gain = sensor.flaws.step_kPa = sensor.flaws.drift_kPa_s = 0;
  return sensor;
}

}  // namespace

Plant::Plant(const PlantConfig& config)
    : minor_loss_K_(config.minor_loss_K),
      hose_(config.hose),
      specimen_(config.C1_kPa, config.flaws.specimen),
      screw_(config.flaws.drive, config.seed),
      piston_(config.piston_lag_ms, hose_.step_s()),
      cavity_sensor_(with_flaws(config.cavity, config.flaws.sensors, true), hose_.step_s(), 2 * config.seed),
      pump_sensor_(with_flaws(config.pump, config.flaws.sensors, false), hose_.step_s(), 2 * config.seed + 1),
      loss_kPa_s2_per_mL2_(loss_factor(config)),
      pump_gas_{config.flaws.pump.gas_mL, gas_exponent},
      pump_leak_mL_s_kPa_(config.flaws.pump.leak_mL_s_kPa),
      cavity_flaws_(config.flaws.cavity),
      leak_mL_s_kPa_(cavity_flaws_.leak_mL_s_kPa),
      bubble_{cavity_flaws_.gas_mL, gas_exponent} {}

void Plant::begin_cycle() {
  screw_.begin_cycle();
  specimen_.begin_cycle();
  cavity_sensor_.begin_cycle();
  pump_sensor_.begin_cycle();
}

void Plant::advance_to(double time_s) {
  while (static_cast<double>(step_count_ + 1) * step_s() <= time_s)
    step();
  since_step_s_ = time_s - static_cast<double>(step_count_) * step_s();
}

/// The leak's flow and the bubble's share are those of the step's beginning: both change little in half a millisecond.
void Plant::take_disturbances() {
  leaked_mL_ = leak_mL_s_kPa_ * cavity_kPa() * step_s();
  gel_share_ =
      1 / (1 + bubble_.compliance_mL_per_kPa(cavity_kPa()) * specimen_.stiffness_kPa_per_mL(cavity_mL_));
}

double Plant::gel_inflow_mL(double flow_mL_s) const {
  return gel_share_ * (0.5 * step_s() * (outlet_flow_mL_s_ + flow_mL_s) - leaked_mL_);
}

double Plant::solve_outlet_flow_mL_s() const {
  const Characteristic line = hose_.outlet();
  const double kink_K = cavity_mL_ > cavity_flaws_.kink_above_mL ? cavity_flaws_.kink_K : 0;
  const double loss_kPa_s2_per_mL2 = loss_kPa_s2_per_mL2_ * (minor_loss_K_ + blockage_K_ + kink_K);
  double flow = outlet_flow_mL_s_;
  const double half_step_s = 0.5 * step_s() * gel_share_;
  // Newton on a strictly increasing residual that is nearly linear (the line's impedance dominates).
  for (int iteration = 0; iteration < 20; ++iteration) {
    const double volume_mL = cavity_mL_ + gel_inflow_mL(flow);
    const double residual = specimen_.pressure_kPa(volume_mL) + loss_kPa_s2_per_mL2 * flow * std::abs(flow) +
                            line.impedance_kPa_s_per_mL * flow - line.pressure_kPa;
    const double slope = specimen_.stiffness_kPa_per_mL(volume_mL) * half_step_s +
                         2 * loss_kPa_s2_per_mL2 * std::abs(flow) + line.impedance_kPa_s_per_mL;
    const double change = residual / slope;
    flow -= change;
    if (std::abs(change) < 1e-12) break;
  }
  return flow;
}

double Plant::entering_flow_mL_s() const {
  const double swallows_mL_kPa = pump_gas_.compliance_mL_per_kPa(pump_end_kPa()) / step_s();
  const double loses = pump_leak_mL_s_kPa_;
  if (swallows_mL_kPa == 0 && loses == 0) return piston_.flow_mL_s();
  // p = line.p + z Q and Q = Q_piston - C (p - p_before) / dt - G p.
  const Characteristic line = hose_.inlet();
  const double z = line.impedance_kPa_s_per_mL;
  const double pressure_kPa =
      (line.pressure_kPa + z * (piston_.flow_mL_s() + swallows_mL_kPa * pump_end_kPa())) /
      (1 + z * (swallows_mL_kPa + loses));
  return (pressure_kPa - line.pressure_kPa) / z;
}

void Plant::step() {
  const double cavity_before_kPa = cavity_kPa();
  const double pump_before_kPa = pump_end_kPa();
  piston_.advance();
  take_disturbances();
  const double flow_mL_s = solve_outlet_flow_mL_s();
  hose_.advance(entering_flow_mL_s(), flow_mL_s);
  cavity_mL_ += gel_inflow_mL(flow_mL_s);
  outlet_flow_mL_s_ = flow_mL_s;
  specimen_.pass(cavity_mL_, step_s());
  ++step_count_;
  cavity_sensor_.advance(0.5 * (cavity_before_kPa + cavity_kPa()));
  pump_sensor_.advance(0.5 * (pump_before_kPa + pump_end_kPa()));
}

}  // namespace diastole::sim_rig
