#pragma once
// The hose between pump and specimen: a distributed line solved by the method of characteristics.
//
//   dp/dt + (rho c^2 / A) (dQ/dx + dA_r/dt) = 0        mass; fluid and wall elasticity are in c
//   (rho / A) dQ/dt + dp/dx + f(Q) = 0                 momentum
//   dA_r/dt = (phi A p / (rho c^2) - A_r) / tau        slow wall creep: fraction phi of the elastic
//   compliance
//
// f is Hagen-Poiseuille below Re 2000, Blasius above 4000, blended between, plus unsteady friction (Brunone's
// form as written by Vitkovsky, coefficient from Vardy's shear-decay formula). With segments of length dx and
// steps of dx/c the elastic wave travels exactly. The two end nodes share the mean of their friction: with
// that the trapezoidal sum of the end flows is the change of stored_mL() to rounding.
//
//   pump | 0 ---- 1 ---- 2 ---- ... ---- N | cavity        nodes; flow positive towards the cavity

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace diastole::sim_rig {

struct HoseConfig {
  double length_m = 5;
  double bore_mm = 12;
  double wave_speed_m_s = 400;
  double fluid_density_kg_m3 = 1005;
  double fluid_viscosity_Pa_s = 0.001;
  double wall_creep_fraction = 0.05;
  double wall_creep_time_s = 0.1;
  double inertia_factor = 1;  ///< the fluid's inertia over that of a plain tube; the compliance stays
  bool friction = true;
  int segments = 20;
};

/// So many that a step lasts no longer than 0.7 ms, and 20 at least: the wave goes a segment a step.
inline int segments_for(const HoseConfig& hose) {
  constexpr double longest_step_s = 0.7e-3;
  return std::max(20, static_cast<int>(std::ceil(hose.length_m / hose.wave_speed_m_s / longest_step_s)));
}

/// What the line offers at its cavity end at the next step: p = pressure_kPa - impedance_kPa_s_per_mL * flow.
struct Characteristic {
  double pressure_kPa;
  double impedance_kPa_s_per_mL;
};

class Hose {
 public:
  /// Preconditions: all sizes > 0, segments >= 2. Starts at rest at zero pressure.
  explicit Hose(const HoseConfig& config);

  [[nodiscard]] double step_s() const { return step_s_; }
  [[nodiscard]] Characteristic outlet() const;
  /// The same at the pump's end: p = pressure_kPa + impedance_kPa_s_per_mL * flow.
  [[nodiscard]] Characteristic inlet() const;
  /// Carries the line over one step to the given flows at its ends (mL/s at the step's end).
  void advance(double pump_flow_mL_s, double outlet_flow_mL_s);

  [[nodiscard]] double pump_end_kPa() const { return pressure_kPa_.front(); }
  [[nodiscard]] double cavity_end_kPa() const { return pressure_kPa_.back(); }
  /// Volume held by the line beyond its rest volume.
  [[nodiscard]] double stored_mL() const;
  /// Steady friction gradient at a flow, kPa/m.
  [[nodiscard]] double steady_friction_kPa_per_m(double flow_mL_s) const;

 private:
  [[nodiscard]] double reynolds(double flow_mL_s) const;
  [[nodiscard]] double friction_at(size_t node) const;
  [[nodiscard]] double creep_at(size_t node) const;

  HoseConfig config_;
  double area_m2_;
  double segment_m_;
  double wave_speed_m_s_;  // with the inertia as it is
  double step_s_;
  double impedance_kPa_s_per_mL_;
  double compliance_mL_per_kPa_;  // elastic, of one segment
  std::vector<double> pressure_kPa_, flow_mL_s_, flow_before_mL_s_, crept_mL_;
  std::vector<double> friction_kPa_per_m_, creep_drop_kPa_;  // of the present state, for the coming step
  std::vector<double> next_pressure_kPa_, next_flow_mL_s_;
};

}  // namespace diastole::sim_rig
