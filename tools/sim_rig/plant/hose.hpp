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
#include <numbers>
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
  explicit Hose(const HoseConfig& config)
      : config_(config),
        area_m2_(std::numbers::pi / 4 * config.bore_mm * config.bore_mm * 1e-6),
        segment_m_(config.length_m / config.segments),
        wave_speed_m_s_(config.wave_speed_m_s / std::sqrt(config.inertia_factor)),
        step_s_(segment_m_ / wave_speed_m_s_),
        impedance_kPa_s_per_mL_(config.inertia_factor * config.fluid_density_kg_m3 * wave_speed_m_s_ /
                                area_m2_ * m3_per_mL * kPa_per_Pa),
        compliance_mL_per_kPa_(area_m2_ * segment_m_ /
                               (config.fluid_density_kg_m3 * config.wave_speed_m_s * config.wave_speed_m_s) /
                               m3_per_mL / kPa_per_Pa) {
    const auto nodes = static_cast<size_t>(config.segments) + 1;
    for (auto* field : {&pressure_kPa_, &flow_mL_s_, &flow_before_mL_s_, &crept_mL_, &friction_kPa_per_m_,
                        &creep_drop_kPa_, &next_pressure_kPa_, &next_flow_mL_s_}) {
      field->assign(nodes, 0.0);
    }
  }

  [[nodiscard]] double step_s() const { return step_s_; }
  [[nodiscard]] Characteristic outlet() const {
    const size_t last = pressure_kPa_.size() - 1;
    return {pressure_kPa_[last - 1] + impedance_kPa_s_per_mL_ * flow_mL_s_[last - 1] -
                segment_m_ * friction_kPa_per_m_[last - 1] - creep_drop_kPa_[last],
            impedance_kPa_s_per_mL_};
  }
  /// The same at the pump's end: p = pressure_kPa + impedance_kPa_s_per_mL * flow.
  [[nodiscard]] Characteristic inlet() const {
    return {pressure_kPa_[1] - impedance_kPa_s_per_mL_ * flow_mL_s_[1] + segment_m_ * friction_kPa_per_m_[1] -
                creep_drop_kPa_[0],
            impedance_kPa_s_per_mL_};
  }
  /// Carries the line over one step to the given flows at its ends (mL/s at the step's end).
  void advance(double pump_flow_mL_s, double outlet_flow_mL_s) {
    const size_t last = pressure_kPa_.size() - 1;
    const double z = impedance_kPa_s_per_mL_;
    const Characteristic at_outlet = outlet();
    double forward = 0;  // what arrives from the left neighbour: p + z Q
    for (size_t i = 0; i < last; ++i) {
      const double backward = pressure_kPa_[i + 1] - z * flow_mL_s_[i + 1] +
                              segment_m_ * friction_kPa_per_m_[i + 1] - creep_drop_kPa_[i];
      if (i == 0) {
        next_flow_mL_s_[0] = pump_flow_mL_s;
        next_pressure_kPa_[0] = backward + z * pump_flow_mL_s;
      } else {
        next_pressure_kPa_[i] = 0.5 * (forward - creep_drop_kPa_[i] + backward);
        next_flow_mL_s_[i] = 0.5 * (forward - creep_drop_kPa_[i] - backward) / z;
      }
      forward = pressure_kPa_[i] + z * flow_mL_s_[i] - segment_m_ * friction_kPa_per_m_[i];
    }
    next_flow_mL_s_[last] = outlet_flow_mL_s;
    next_pressure_kPa_[last] = at_outlet.pressure_kPa - at_outlet.impedance_kPa_s_per_mL * outlet_flow_mL_s;

    for (size_t i = 0; i <= last; ++i)
      crept_mL_[i] += compliance_mL_per_kPa_ * creep_drop_kPa_[i];
    std::swap(flow_before_mL_s_, flow_mL_s_);
    std::swap(flow_mL_s_, next_flow_mL_s_);
    std::swap(pressure_kPa_, next_pressure_kPa_);
    for (size_t i = 0; i <= last; ++i) {
      if (config_.friction) friction_kPa_per_m_[i] = friction_at(i);
      creep_drop_kPa_[i] = creep_at(i);
    }
    friction_kPa_per_m_.front() = friction_kPa_per_m_.back() =
        0.5 * (friction_kPa_per_m_.front() + friction_kPa_per_m_.back());
  }

  [[nodiscard]] double pump_end_kPa() const { return pressure_kPa_.front(); }
  [[nodiscard]] double cavity_end_kPa() const { return pressure_kPa_.back(); }
  /// Volume held by the line beyond its rest volume.
  [[nodiscard]] double stored_mL() const {
    const auto of_node = [&](size_t i) { return compliance_mL_per_kPa_ * pressure_kPa_[i] + crept_mL_[i]; };
    const size_t last = pressure_kPa_.size() - 1;
    double sum = 0.5 * (of_node(0) + of_node(last));
    for (size_t i = 1; i < last; ++i)
      sum += of_node(i);
    return sum;
  }
  /// Steady friction gradient at a flow, kPa/m.
  [[nodiscard]] double steady_friction_kPa_per_m(double flow_mL_s) const {
    const double bore_m = config_.bore_mm * 1e-3;
    const double speed_m_s = flow_mL_s * m3_per_mL / area_m2_;
    const double re = reynolds(flow_mL_s);
    const double share = turbulent_share(re);
    double gradient_Pa_m = (1 - share) * 32 * config_.fluid_viscosity_Pa_s * speed_m_s / (bore_m * bore_m);
    if (share > 0) {
      const double darcy = 0.3164 / std::sqrt(std::sqrt(re));
      gradient_Pa_m +=
          share * darcy * config_.fluid_density_kg_m3 * speed_m_s * std::abs(speed_m_s) / (2 * bore_m);
    }
    return gradient_Pa_m * kPa_per_Pa;
  }

 private:
  static constexpr double m3_per_mL = 1e-6;
  static constexpr double kPa_per_Pa = 1e-3;

  /// 0 in laminar, 1 in turbulent flow, smooth between.
  static double turbulent_share(double reynolds) {
    const double x = std::clamp((reynolds - 2000) / 2000, 0.0, 1.0);
    return x * x * (3 - 2 * x);
  }

  /// Vardy's shear-decay coefficient C*; Brunone's k = sqrt(C*) / 2.
  static double brunone_coefficient(double reynolds) {
    constexpr double laminar = 0.00476;
    const double share = turbulent_share(reynolds);
    if (share == 0) return 0.5 * std::sqrt(laminar);
    const double turbulent = 7.41 / std::pow(reynolds, std::log10(14.3 / std::pow(reynolds, 0.05)));
    return 0.5 * std::sqrt((1 - share) * laminar + share * turbulent);
  }

  [[nodiscard]] double reynolds(double flow_mL_s) const {
    const double speed_m_s = std::abs(flow_mL_s) * m3_per_mL / area_m2_;
    return config_.fluid_density_kg_m3 * speed_m_s * config_.bore_mm * 1e-3 / config_.fluid_viscosity_Pa_s;
  }
  [[nodiscard]] double friction_at(size_t node) const {
    const double flow = flow_mL_s_[node];
    const size_t left = node == 0 ? 0 : node - 1;
    const size_t right = std::min(node + 1, flow_mL_s_.size() - 1);
    const double along_mL_s_m =
        (flow_mL_s_[right] - flow_mL_s_[left]) / (static_cast<double>(right - left) * segment_m_);
    const double in_time_mL_s2 = (flow - flow_before_mL_s_[node]) / step_s_;
    const double sign = flow > 0 ? 1 : (flow < 0 ? -1 : 0);
    const double unsteady_mL_s2 = in_time_mL_s2 + wave_speed_m_s_ * sign * std::abs(along_mL_s_m);
    const double density_over_area = config_.fluid_density_kg_m3 / area_m2_ * m3_per_mL * kPa_per_Pa;
    return steady_friction_kPa_per_m(flow) +
           0.5 * brunone_coefficient(reynolds(flow)) * density_over_area * unsteady_mL_s2;
  }
  [[nodiscard]] double creep_at(size_t node) const {
    const double rate_mL_s =
        (config_.wall_creep_fraction * compliance_mL_per_kPa_ * pressure_kPa_[node] - crept_mL_[node]) /
        config_.wall_creep_time_s;
    return rate_mL_s * step_s_ / compliance_mL_per_kPa_;
  }

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
