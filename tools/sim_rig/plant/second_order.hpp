#pragma once
// A second-order lag, stepped exactly: the catheter with its transducer, and the motor's rotor in its
// magnetic spring.
//
//   y'' = w0^2 (u - y) - 2 zeta w0 y',   w0 = 2 pi f0
//
// One step carries (y, y') over step_s with the matrix exponential; the input is held at its mean over the
// step.

#include <array>
#include <cmath>
#include <numbers>

namespace diastole::sim_rig {

class SecondOrder {
 public:
  /// Preconditions: f0_Hz > 0, zeta > 0, step_s > 0. Starts at rest at 0.
  SecondOrder(double f0_Hz, double zeta, double step_s)
      : propagator_([&] {
          const double w0 = 2 * std::numbers::pi * f0_Hz;
          return exponential({0, step_s, -w0 * w0 * step_s, -2 * zeta * w0 * step_s});
        }()) {}

  void advance(double mean_input) {
    const double away = value_ - mean_input;
    value_ = mean_input + propagator_[0] * away + propagator_[1] * rate_;
    rate_ = propagator_[2] * away + propagator_[3] * rate_;
  }

  [[nodiscard]] double value() const { return value_; }
  /// d value / dt, per second.
  [[nodiscard]] double rate() const { return rate_; }

 private:
  using Matrix2 = std::array<double, 4>;

  static Matrix2 product(const Matrix2& a, const Matrix2& b) {
    return {a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2],
            a[2] * b[1] + a[3] * b[3]};
  }

  /// exp(m) by its power series on m / 2^10, squared back ten times.
  static Matrix2 exponential(Matrix2 m) {
    constexpr int halvings = 10;
    for (double& entry : m)
      entry = std::ldexp(entry, -halvings);
    Matrix2 sum{1, 0, 0, 1};
    Matrix2 term = sum;
    for (int k = 1; k <= 12; ++k) {
      term = product(term, m);
      for (double& entry : term)
        entry /= k;
      for (size_t i = 0; i < sum.size(); ++i)
        sum[i] += term[i];
    }
    for (int k = 0; k < halvings; ++k)
      sum = product(sum, sum);
    return sum;
  }

  std::array<double, 4> propagator_;  // row-major, (y - u, y') over one step
  double value_ = 0;
  double rate_ = 0;
};

}  // namespace diastole::sim_rig
