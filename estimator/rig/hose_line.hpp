#pragma once
// The hose as a distributed line: a Galerkin method in the volume that has passed each section.
//
//   xi(X, t) [mL], X = x / L in [0, 1]; flow q = xi_t, volume stored a length -xi_x, pressure p = -xi_x / C' less the
//   wall's creep. With rho/A xi_tt + p_x + R = 0 (R: WallFriction) and the ansatz
//
//     xi = xi0(t) - u(t) X + sum_n a_n(t) sin(n pi X)
//
//   xi0 is what has entered, u = xi0 - xi(1) what the hose keeps. Weighted with 1, -X and sin(n pi X) the equation gives
//
//     I (  xi0'' - u''/2 + sum g_n a_n'')          =  p_0 - p_L - F_1
//     I (- xi0''/2 + u''/3 - sum b_n a_n'')        = -P_0 + p_L + F_X
//     I (g_n xi0'' - b_n u'' + a_n''/2)            =  n pi/2 P_n - F_n
//
//   I inertance, g_n = (1 - (-1)^n)/(n pi), b_n = (-1)^(n+1)/(n pi), F the drag's weighted integrals over the length;
//   P_0 = u/C - d e_0, P_n = -n pi a_n/C - d e_n are the pressure's cosine components, e_n' = (P_n - e_n)/tau the
//   creep's (d its fraction of the elastic compliance C); the wall's own loss adds wall_loss times the rates of u and a_n to
//   them. Energy is kept exactly but for drag, creep and that; components converge as 1/n^3 and fast, since motors spread
//   their accelerations over many travel times.
//
// Time: the linear part by its matrix exponential, exactly; end pressures and drag enter as forces that are linear
// within a step (exponential time differencing, predictor and corrector). So the step may be far longer than the
// line's fastest period, and no numerical damping is added.
//
// What enters is what the piston displaces, or that and a degree of freedom y more (less, as y is negative), if there is
// a gas or a leak before the hose: p_0 = -K y for a gas of stiffness K, p_0 = -R y' for a leak of resistance R, and what
// differs from this linear end is given as a load.

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "estimator/rig/boundary_layer.hpp"
#include "estimator/rig/hose.hpp"
#include "estimator/rig/small_matrix.hpp"

namespace diastole::rig {

struct LineOptions {
  double step_s = 1.0 / 600.0;
  size_t components = 4;                       ///< n = 1 ... components
  std::optional<double> pump_stiffness = {};   ///< K, kPa/mL
  std::optional<double> pump_resistance = {};  ///< R, kPa s/mL
};

/// What acts on the line's ends at one time.
struct EndLoads {
  double piston_acceleration = 0.0;  ///< mL/s^2
  double pump_kPa = 0.0;             ///< p_0 less what the linear end makes; only if there is a gas or a leak
  double cavity_kPa = 0.0;           ///< p_L
};

/// By how much y and y' at a step's end are larger for a kPa more of the pump's load there.
struct YieldByLoad {
  double mL_per_kPa = 0.0, mL_per_s_kPa = 0.0;
};

class HoseLine {
 public:
  HoseLine(const Hose& hose, const LineOptions& options);

  [[nodiscard]] double kept_mL() const { return kept(0); }
  /// y: what has entered beyond what the piston displaced.
  [[nodiscard]] double yielded_mL() const { return yields_ ? state_[0] : 0.0; }
  [[nodiscard]] double yielding_mL_per_s() const { return yields_ ? state_[count_] : 0.0; }
  [[nodiscard]] double entering_mL_per_s() const { return piston_flow_ + yielding_mL_per_s(); }
  [[nodiscard]] double leaving_mL_per_s() const { return entering_mL_per_s() - kept(count_); }

  /// The balance at the state at hand under these loads: pump_kPa() and the forces.
  void settle(const EndLoads& loads);
  /// Begins a step after `settle`: predicts its end. `now` may hold another acceleration than was settled (one whose
  /// integral is right); `piston_flow_at_end` is the piston's at the end, mL/s.
  void begin_step(const EndLoads& now, double piston_flow_at_end);
  /// The state at the step's end, with the loads that belong to the predicted one.
  void end_step(const EndLoads& then);
  /// The state at the step's end, predicted or not, with so much more of the pump's load there; only if y is a degree of freedom.
  void add_pump_load(double more_kPa) { state_ += more_kPa * by_pump_load_; }
  [[nodiscard]] YieldByLoad yield_by_load() const { return {by_pump_load_[0], by_pump_load_[count_]}; }
  /// p_0 when last settled, kPa.
  [[nodiscard]] double pump_kPa() const { return pump_kPa_; }

  /// How fast the flow that leaves gathers when the cavity sucks by a kPa, mL/(s^2 kPa), nothing else giving way.
  [[nodiscard]] double outflow_by_suction() const { return cavity_shape_.dot(inverse_mass_ * cavity_shape_); }
  /// Kinetic energy of the fluid and energy stored in the wall's elastic part, mJ (kPa mL).
  [[nodiscard]] double energy_mJ() const;
  /// Power lost in drag and in the wall, mW, at the state at hand.
  [[nodiscard]] double loss_mW() const;

 private:
  /// What the hose keeps of the positions (from = 0) or velocities (from = count_).
  [[nodiscard]] double kept(Eigen::Index from) const {
    double sum = 0.0;
    for (Eigen::Index n = 0; n <= modes_; ++n)
      sum += cavity_shape_[first_ + n] * state_[from + first_ + n];
    return sum;
  }
  void make_equations();
  void make_step(double step_s);
  void make_drag(double length_m);
  /// Forces at the state at hand, a step's end for good (`is_settled`) or as predicted. The drag holds dv/dt, which it changes by
  /// some percent: each pass starts from the rate found last.
  void forces(const EndLoads& loads, int passes, bool is_settled);
  /// Adds the boundary layer's part to the drag.
  void remember(bool is_settled);
  /// Coefficients of the pressure along the line: uniform, cosines.
  [[nodiscard]] Eigen::VectorXd pressures() const;
  /// Mean over the length of the product of two such functions.
  [[nodiscard]] double mean_product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const;

  bool yields_;         ///< y is a degree of freedom
  Eigen::Index first_;  ///< index of u
  Eigen::Index count_;  ///< degrees of freedom
  Eigen::Index modes_;
  double inertance_, compliance_, creep_, creep_time_, wall_loss_, to_speed_, pump_stiffness_,
      pump_resistance_;
  WallFriction friction_;
  BoundaryLayer layer_;

  Eigen::MatrixXd mass_, inverse_mass_, stiffness_, damping_, creep_coupling_;
  Eigen::VectorXd cavity_shape_;  ///< of p_L in the equations
  Eigen::VectorXd piston_mass_;   ///< of the piston's acceleration in the equations
  Eigen::MatrixXd pull_;          ///< accelerations by the state

  // A step: state at the end by the state and the forces at its ends.
  SmallMatrix flow_, from_start_, from_end_;
  // At the points along the line: speeds and stretchings by velocities; dv/dt by state, forces, drag.
  SmallMatrix speeds_, rate_by_state_, rate_by_force_, rate_by_drag_, force_by_drag_;
  Eigen::VectorXd point_part_, point_weight_;  ///< of the length, and in m
  Eigen::VectorXd pump_by_state_, pump_by_force_, by_pump_load_;

  Eigen::VectorXd state_, drifted_, bare_, force_, speed_, bare_rate_, rate_, gradient_;
  WallFriction::Drag drag_;
  double piston_flow_ = 0.0, settled_acceleration_ = 0.0, pump_kPa_ = 0.0;
};

}  // namespace diastole::rig
