#pragma once
// A second-order lag, stepped exactly: the catheter with its transducer, and the motor's rotor in its
// magnetic spring.
//
//   y'' = w0^2 (u - y) - 2 zeta w0 y',   w0 = 2 pi f0
//
// One step carries (y, y') over step_s with the matrix exponential; the input is held at its mean over the
// step.

#include <array>

namespace diastole::sim_rig {

class SecondOrder {
 public:
  /// Preconditions: f0_Hz > 0, zeta > 0, step_s > 0. Starts at rest at 0.
  SecondOrder(double f0_Hz, double zeta, double step_s);

  void advance(double mean_input);

  [[nodiscard]] double value() const { return value_; }
  /// d value / dt, per second.
  [[nodiscard]] double rate() const { return rate_; }

 private:
  std::array<double, 4> propagator_;  // row-major, (y - u, y') over one step
  double value_ = 0;
  double rate_ = 0;
};

}  // namespace diastole::sim_rig
