#pragma once
// The fluid near the wall of a round bore remembers how the flow has changed (W. Zielke, J. Basic Eng. 90 (1968) 109):
//
//   R_u(t) = (16 mu / D^2) int_0^t dv/dt(s) W(4 nu (t - s) / D^2) ds,   W(T) = sum_k m_k exp(-n_k T)
//
// with the terms of T. Kagawa et al., Trans. JSME B 49 (1983) 2638. In oscillating laminar flow that is Womersley's solution:
// the layer weighs like more fluid and holds it back as much. Turbulence wipes the memory out (WallFriction::Drag::forgetting).
// Its fastest terms add to the inertia only. The flow is taken to be the same all along the hose, which keeps a thousandth of it.
//
// Units: m/s, s, kPa/m. One lives for one line.

#include <Eigen/Core>

#include "estimator/rig/hose.hpp"

namespace diastole::rig {

class BoundaryLayer {
 public:
  /// Steps of one length.
  BoundaryLayer(const Hose& hose, double step_s);

  [[nodiscard]] bool exists() const { return scale_ != 0.0; }
  /// Goes on by a step, at whose end the fluid has this speed and forgets so much faster (WallFriction::Drag).
  void pass(double speed_m_s, double forgetting);
  /// R_u now.
  [[nodiscard]] double drag() const { return scale_ * memory_.sum(); }
  /// R_u at the end of a step from now.
  [[nodiscard]] double drag_after(double speed_m_s, double forgetting) const;
  /// kPa s^2/m^2: of dv/dt, by the fastest terms.
  [[nodiscard]] double inertia() const { return inertia_; }

 private:
  /// Of what there was at a step's start, in its middle, where what is gained comes in.
  [[nodiscard]] double left_halfway(double forgetting) const {
    const double lost = 0.5 * forgetting * step_s_;
    return 1.0 / (1.0 + lost * (1.0 + 0.5 * lost));
  }

  double scale_, step_s_, inertia_ = 0.0, all_gained_ = 0.0;
  static constexpr int remembered = 8;  ///< of the terms; the others are gone within a millisecond
  using Terms = Eigen::Array<double, remembered, 1>;
  Terms kept_, gained_;  ///< of the memory and of the speed's change, in a step
  Terms memory_ = Terms::Zero();
  double speed_ = 0.0;
};

}  // namespace diastole::rig
