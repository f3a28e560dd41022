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

#include <cstddef>
#include <cstdint>

#include "tools/sim_rig/plant/air_bubble.hpp"
#include "tools/sim_rig/plant/flaws.hpp"
#include "tools/sim_rig/plant/hose.hpp"
#include "tools/sim_rig/plant/piston.hpp"
#include "tools/sim_rig/plant/screw.hpp"
#include "tools/sim_rig/plant/sensor.hpp"
#include "tools/sim_rig/plant/specimen.hpp"

namespace diastole::sim_rig {

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
  explicit Plant(const PlantConfig& config);

  /// The controller has displaced `volume_mL` in all since `time_s` (not before the plant's present).
  void displace(double time_s, double volume_mL) { piston_.displace(time_s, screw_.follow(volume_mL)); }
  /// The controller's TTL has risen.
  void begin_cycle();

  /// Moves to `time_s`; every edge up to then must have been handed over.
  void advance_to(double time_s);

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
  void admit(const AirBubble& bubble) { bubble_ = bubble; }
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
  void step();
  /// The flow into the cavity at the step's end, from the hose's characteristic, cannula loss and gel.
  [[nodiscard]] double solve_outlet_flow_mL_s() const;
  /// What of the piston's flow enters the hose, beside gas and leak at the pump.
  [[nodiscard]] double entering_flow_mL_s() const;

  void take_disturbances();
  /// Volume that enters the gel in a step with this flow at its end, beside bubble and leak.
  [[nodiscard]] double gel_inflow_mL(double flow_mL_s) const;

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
  double pump_leak_mL_s_kPa_;
  CavityFlaws cavity_flaws_;
  double leak_mL_s_kPa_;
  double blockage_K_ = 0;
  AirBubble bubble_;
  double leaked_mL_ = 0;  // in this step
  double gel_share_ = 1;  // of a change of the cavity's volume; the bubble gives way for the rest
  double cavity_mL_ = 0;  // of the gel; the bubble's share is not in it
  double outlet_flow_mL_s_ = 0;
};

}  // namespace diastole::sim_rig
