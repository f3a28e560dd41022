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
//   creep's (d its fraction of the elastic compliance C). Energy is kept exactly but for drag and creep; components
//   converge as 1/n^3 and fast, since motors spread their accelerations over many travel times.
//
// Time: the linear part by its matrix exponential, exactly; end pressures and drag enter as forces that are linear
// within a step (exponential time differencing, predictor and corrector). So the step may be far longer than the
// line's fastest period, and no numerical damping is added.
//
// The pump end either has its volume prescribed, or (with `pump_stiffness`) is one more degree of freedom, pushed by
// the pressure p_0 of a gas between piston and hose.

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "estimator/rig/hose.hpp"

namespace diastole::rig {

struct LineOptions {
  double step_s = 1.0 / 600.0;
  size_t components = 4;                      ///< n = 1 ... components
  std::optional<double> pump_stiffness = {};  ///< kPa/mL, of the gas at rest
};

/// What acts on the line's ends at one time.
struct EndLoads {
  double entering_acceleration = 0.0;  ///< xi0'', mL/s^2; only if the volume is prescribed
  double pump_kPa = 0.0;               ///< p_0; only with pump_stiffness
  double cavity_kPa = 0.0;             ///< p_L
};

class HoseLine {
 public:
  HoseLine(const Hose& hose, const LineOptions& options);

  /// To rest: no flow, and the whole line at this pressure with its wall crept out.
  void rest_at(double pressure_kPa);

  [[nodiscard]] double kept_mL() const { return kept(0); }
  [[nodiscard]] double entered_mL() const {
    return free_ ? state_[0] : 0.0;
  }  ///< xi0, if a degree of freedom
  [[nodiscard]] double entering_mL_per_s() const { return free_ ? state_[count_] : entering_flow_; }
  [[nodiscard]] double leaving_mL_per_s() const { return entering_mL_per_s() - kept(count_); }

  /// The balance at the state at hand under these loads: pump_kPa() and the accelerations.
  void settle(const EndLoads& loads);
  /// Begins a step after `settle`: predicts its end. With the volume prescribed, `now` may hold another acceleration
  /// than was settled (one whose integral is right), and `entering_flow_at_end` is xi0' at the end.
  void begin_step(const EndLoads& now, double entering_flow_at_end);
  /// The state at the step's end, with the loads that belong to the predicted one.
  void end_step(const EndLoads& then);
  /// The pressure at the pump end that keeps the momentum balance, kPa, when last settled.
  [[nodiscard]] double pump_kPa() const { return pump_kPa_; }

  /// Kinetic energy of the fluid and energy stored in the wall's elastic part, mJ (kPa mL).
  [[nodiscard]] double energy_mJ() const;
  /// Power lost in drag and creep, mW, at the state at hand.
  [[nodiscard]] double loss_mW() const;

 private:
  /// What the hose keeps of the positions (from = 0) or velocities (from = count_).
  [[nodiscard]] double kept(Eigen::Index from) const {
    return cavity_shape_.tail(modes_ + 1).dot(state_.segment(from + first_, modes_ + 1));
  }
  void make_matrices(const Hose& hose, double step_s);
  /// Forces and accelerations at the state at hand. The drag holds dv/dt, which it changes by less than two percent:
  /// each pass starts from the rate found last.
  void forces(const EndLoads& loads, int passes);
  /// Coefficients of the pressure along the line: uniform, cosines.
  [[nodiscard]] Eigen::VectorXd pressures() const;
  /// Mean over the length of the product of two such functions.
  [[nodiscard]] double mean_product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const;
  void add_drag(double entering_acceleration, int passes);

  bool free_;           ///< the pump end is a degree of freedom
  Eigen::Index first_;  ///< index of u
  Eigen::Index count_;  ///< degrees of freedom
  Eigen::Index modes_;
  double inertance_, compliance_, creep_, creep_time_, to_speed_, pump_stiffness_;
  WallFriction friction_;

  Eigen::MatrixXd mass_, inverse_mass_, stiffness_, creep_coupling_;
  Eigen::VectorXd cavity_shape_;   ///< of p_L in the equations
  Eigen::VectorXd entering_mass_;  ///< of xi0'' in the equations, when prescribed
  Eigen::MatrixXd pull_;           ///< accelerations by the state
  Eigen::MatrixXd flow_, from_start_, from_end_;
  Eigen::MatrixXd speed_shape_, stretch_shape_, drag_weight_;  ///< at the points along the line
  Eigen::VectorXd point_weight_;

  Eigen::VectorXd state_, drifted_, force_, acceleration_, speed_, speed_rate_, stretch_, steady_, gradient_,
      pulled_, bare_force_;
  double entering_flow_ = 0.0, settled_acceleration_ = 0.0, drag_along_ = 0.0, pump_kPa_ = 0.0;
};

}  // namespace diastole::rig
