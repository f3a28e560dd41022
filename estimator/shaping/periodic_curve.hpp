#pragma once
// A curve that comes again every period, by its harmonics:
//
//   x(t) = c_0 + 2 Re sum_{k=1..K} c_k exp(2 pi i k t / T)
//
// so that the mean square of x is |c_0|^2 + 2 sum |c_k|^2 (Parseval).

#include <Eigen/Dense>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace diastole::shaping {

struct PeriodicCurve {
  double period_s = 1.0;
  Eigen::VectorXcd c = Eigen::VectorXcd::Zero(1);  ///< 0 ... K

  [[nodiscard]] Eigen::Index harmonics() const { return c.size() - 1; }
  [[nodiscard]] double frequency_Hz(Eigen::Index k) const { return static_cast<double>(k) / period_s; }
  /// The curve (order 0) or its first or second derivative by time.
  [[nodiscard]] double at(double time_s, int order = 0) const;
  /// At j T / count, j = 0 ... count - 1.
  [[nodiscard]] std::vector<double> at_even(size_t count, int order = 0) const;
  [[nodiscard]] double range() const;
  /// The time in [0, T) at which it is least.
  [[nodiscard]] double least_at_s() const;
  /// The same curve with so many harmonics; new ones are zero.
  [[nodiscard]] PeriodicCurve with(Eigen::Index harmonics) const;
};

/// The curve as real numbers c_0, sqrt2 Re c_1, sqrt2 Im c_1, ...: their norm is the curve's root mean square. And back.
Eigen::VectorXd numbers_of(const PeriodicCurve& curve);
PeriodicCurve curve_of(const Eigen::VectorXd& numbers, double period_s);

/// Of values at j T / n. Precondition: fewer than n/2 harmonics.
PeriodicCurve periodic_curve(std::span<const double> even_values, double period_s, Eigen::Index harmonics);

/// As few harmonics as hold all but this part of its range (root mean square), not beyond `most`.
Eigen::Index harmonics_needed(const PeriodicCurve& curve, double part, Eigen::Index most);

/// A curve that was measured.
struct MeasuredCurve {
  PeriodicCurve curve;
  Eigen::VectorXd sigma;  ///< root of E|error|^2 of each c_k; infinite: not measured
};

/// Least squares through values with errors at any times. Precondition: 2 harmonics + 1 values or more.
MeasuredCurve fitted_curve(std::span<const double> time_s, std::span<const double> values,
                           std::span<const double> sigma, double period_s, Eigen::Index harmonics);

inline constexpr double not_measured = std::numeric_limits<double>::infinity();

}  // namespace diastole::shaping
