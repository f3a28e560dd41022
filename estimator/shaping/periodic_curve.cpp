#include "estimator/shaping/periodic_curve.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace diastole::shaping {
namespace {

using Complex = std::complex<double>;
using std::numbers::pi;

/// For extremes: finer than the shortest wave of any curve here.
constexpr size_t fine = 1024;

}  // namespace

double PeriodicCurve::at(double time_s, int order) const {
  const double omega = 2.0 * pi / period_s;
  const Complex turn = std::polar(1.0, omega * time_s);
  Complex turned = 1.0, sum = 0.0;
  for (Eigen::Index k = 1; k < c.size(); ++k) {
    turned *= turn;
    Complex term = c[k] * turned;
    for (int i = 0; i < order; ++i)
      term *= Complex(0.0, omega * static_cast<double>(k));
    sum += term;
  }
  return (order == 0 ? c[0].real() : 0.0) + 2.0 * sum.real();
}

std::vector<double> PeriodicCurve::at_even(size_t count, int order) const {
  std::vector<double> values(count);
  for (size_t j = 0; j < count; ++j)
    values[j] = at(period_s * static_cast<double>(j) / static_cast<double>(count), order);
  return values;
}

double PeriodicCurve::range() const {
  const std::vector<double> values = at_even(fine);
  return std::ranges::max(values) - std::ranges::min(values);
}

double PeriodicCurve::least_at_s() const {
  const std::vector<double> values = at_even(fine);
  const auto least = std::ranges::min_element(values) - values.begin();
  return period_s * static_cast<double>(least) / static_cast<double>(fine);
}

PeriodicCurve PeriodicCurve::with(Eigen::Index count) const {
  PeriodicCurve other{period_s, Eigen::VectorXcd::Zero(count + 1)};
  const Eigen::Index common = std::min(count, harmonics()) + 1;
  other.c.head(common) = c.head(common);
  return other;
}

Eigen::VectorXd numbers_of(const PeriodicCurve& curve) {
  Eigen::VectorXd numbers(2 * curve.harmonics() + 1);
  numbers[0] = curve.c[0].real();
  for (Eigen::Index k = 1; k <= curve.harmonics(); ++k)
    numbers.segment(2 * k - 1, 2) << std::numbers::sqrt2 * curve.c[k].real(),
        std::numbers::sqrt2 * curve.c[k].imag();
  return numbers;
}

PeriodicCurve curve_of(const Eigen::VectorXd& numbers, double period_s) {
  PeriodicCurve curve{period_s, Eigen::VectorXcd::Zero((numbers.size() + 1) / 2)};
  curve.c[0] = numbers[0];
  for (Eigen::Index k = 1; k <= curve.harmonics(); ++k)
    curve.c[k] = Complex(numbers[2 * k - 1], numbers[2 * k]) / std::numbers::sqrt2;
  return curve;
}

PeriodicCurve periodic_curve(std::span<const double> even_values, double period_s, Eigen::Index harmonics) {
  PeriodicCurve curve{period_s, Eigen::VectorXcd::Zero(harmonics + 1)};
  const auto count = static_cast<double>(even_values.size());
  for (Eigen::Index k = 0; k <= harmonics; ++k)
    for (size_t j = 0; j < even_values.size(); ++j)
      curve.c[k] += even_values[j] / count *
                    std::polar(1.0, -2.0 * pi * static_cast<double>(k) * static_cast<double>(j) / count);
  return curve;
}

Eigen::Index harmonics_needed(const PeriodicCurve& curve, double part, Eigen::Index most) {
  const double allowed = std::pow(part * curve.range(), 2);
  double left = 0.0;
  Eigen::Index k = curve.harmonics();
  for (; k > 1; --k) {
    left += 2.0 * std::norm(curve.c[k]);
    if (left > allowed) break;
  }
  return std::clamp<Eigen::Index>(k, 1, most);
}

MeasuredCurve fitted_curve(std::span<const double> time_s, std::span<const double> values,
                           std::span<const double> sigma, double period_s, Eigen::Index harmonics) {
  const auto rows = static_cast<Eigen::Index>(values.size());
  Eigen::MatrixXd basis(rows, 2 * harmonics + 1);
  Eigen::VectorXd seen(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto at = static_cast<size_t>(i);
    const double weight = 1.0 / sigma[at];
    seen[i] = weight * values[at];
    basis(i, 0) = weight;
    for (Eigen::Index k = 1; k <= harmonics; ++k) {
      const double turn = 2.0 * pi * static_cast<double>(k) * time_s[at] / period_s;
      basis(i, 2 * k - 1) = 2.0 * weight * std::cos(turn);
      basis(i, 2 * k) = -2.0 * weight * std::sin(turn);
    }
  }
  const Eigen::LLT<Eigen::MatrixXd> normal(basis.transpose() * basis);
  const Eigen::VectorXd fit = normal.solve(basis.transpose() * seen);
  const Eigen::VectorXd variance =
      normal.solve(Eigen::MatrixXd::Identity(basis.cols(), basis.cols())).diagonal();
  MeasuredCurve measured{{period_s, Eigen::VectorXcd::Zero(harmonics + 1)},
                         Eigen::VectorXd::Zero(harmonics + 1)};
  measured.curve.c[0] = fit[0];
  measured.sigma[0] = std::sqrt(variance[0]);
  for (Eigen::Index k = 1; k <= harmonics; ++k) {
    measured.curve.c[k] = {fit[2 * k - 1], fit[2 * k]};
    measured.sigma[k] = std::sqrt(variance[2 * k - 1] + variance[2 * k]);
  }
  return measured;
}

}  // namespace diastole::shaping
