#include "tools/sim_scanner/flow_phantom.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace diastole::scanner {
namespace {

using Complex = std::complex<double>;
using std::numbers::pi;

/// Power series of J0 and of 2 J1(z) / z; for |z| below 60 the largest term exceeds the sum by less than 10^9.
Complex j0(Complex z) {
  Complex term = 1, sum = 1;
  for (int k = 1; k < 400; ++k) {
    term *= -z * z / (4.0 * k * k);
    sum += term;
    if (std::abs(term) < 1e-17 * std::abs(sum)) break;
  }
  return sum;
}
Complex two_j1_over(Complex z) {
  Complex term = 1, sum = 1;
  for (int k = 1; k < 400; ++k) {
    term *= -z * z / (4.0 * k * (k + 1));
    sum += term;
    if (std::abs(term) < 1e-17 * std::abs(sum)) break;
  }
  return sum;
}

/// Flow of constant acceleration, a triangle wave: its sine harmonics are odd, softened by the hose.
double amplitude_mL_s(const FlowPhantom& phantom, int n) {
  if (n % 2 == 0) return 0;
  const double peak =
      4 * phantom.stroke_mL / phantom.period_s;  // of the triangle: half the cycle's mean twice over
  const double sign = (n / 2) % 2 == 0 ? 1 : -1;
  const double share = static_cast<double>(n) / (phantom.harmonics + 1);
  return sign * peak * 8 / (pi * pi * n * n) * std::exp(-share * share);
}

double angular(const FlowPhantom& phantom, int n) { return 2 * pi * n / phantom.period_s; }

int harmonics_of(const FlowPhantom& phantom) {
  return phantom.course.empty() ? phantom.harmonics : static_cast<int>(phantom.course.size());
}

/// The flow's real part of  q exp(i n omega t). A sine is the real part of -i exp(i w t).
Complex harmonic_mL_s(const FlowPhantom& phantom, int n) {
  if (!phantom.course.empty()) return phantom.course[static_cast<size_t>(n - 1)];
  return Complex(0, -1) * amplitude_mL_s(phantom, n) *
         std::exp(Complex(0, -angular(phantom, n) * phantom.delay_s));
}

}  // namespace

void FlowPhantom::follow(const std::vector<double>& times_s, const std::vector<double>& known_mL) {
  const auto count = static_cast<Eigen::Index>(times_s.size());
  const Eigen::Index pairs = (count - 1) / 2;
  Eigen::MatrixXd waves(count, 1 + 2 * pairs);
  for (Eigen::Index k = 0; k < count; ++k) {
    waves(k, 0) = 1;
    for (Eigen::Index n = 1; n <= pairs; ++n) {
      const double turn = angular(*this, static_cast<int>(n)) * times_s[static_cast<size_t>(k)];
      waves(k, 2 * n - 1) = std::cos(turn);
      waves(k, 2 * n) = std::sin(turn);
    }
  }
  const Eigen::VectorXd shares =
      waves.colPivHouseholderQr().solve(Eigen::Map<const Eigen::VectorXd>(known_mL.data(), count));
  course.clear();
  for (Eigen::Index n = 1; n <= pairs; ++n) {
    // a cos + b sin is the real part of (a - i b) exp(i w t), and flow is its derivative.
    const Complex volume_mL(shares[2 * n - 1], -shares[2 * n]);
    course.push_back(Complex(0, angular(*this, static_cast<int>(n))) * volume_mL);
  }
}

double FlowPhantom::flow_mL_s(double time_s) const {
  double flow = steady_mL_s;
  for (int n = 1; n <= harmonics_of(*this); ++n)
    flow += std::real(harmonic_mL_s(*this, n) * std::exp(Complex(0, angular(*this, n) * time_s)));
  return flow;
}

double FlowPhantom::volume_mL(double time_s) const {
  double volume = steady_mL_s * time_s;
  for (int n = 1; n <= harmonics_of(*this); ++n) {
    const Complex iw(0, angular(*this, n));
    volume += std::real(harmonic_mL_s(*this, n) * (std::exp(iw * time_s) - 1.0) / iw);
  }
  return volume;
}

double FlowPhantom::peak_cm_s() const {
  double peak = 0;
  for (int i = 0; i < 60; ++i) {
    const VelocityProfile profile(*this, period_s * i / 60);
    for (int k = 0; k < 50; ++k)
      peak = std::max(peak, std::abs(profile.at(0.5 * bore_mm * k / 50)));
  }
  return peak;
}

VelocityProfile::VelocityProfile(const FlowPhantom& phantom, double time_s)
    : radius_mm_(0.5 * phantom.bore_mm), values_(steps + 1) {
  const double area_mm2 = pi * radius_mm_ * radius_mm_;
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    values_[static_cast<size_t>(i)] = 100 * phantom.steady_mL_s / area_mm2 * 2 * (1 - share * share);
  }
  const Complex root = std::pow(Complex(0, 1), 1.5);
  for (int n = 1; n <= harmonics_of(phantom); ++n) {
    const Complex flow_mL_s = harmonic_mL_s(phantom, n);
    if (flow_mL_s == Complex(0)) continue;
    const double w = angular(phantom, n);
    const Complex b = root * radius_mm_ * std::sqrt(w / phantom.viscosity_mm2_s);
    const Complex at_wall = j0(b);
    const Complex whole = 1.0 - two_j1_over(b) / at_wall;
    const Complex now = flow_mL_s * std::exp(Complex(0, w * time_s));
    for (int i = 0; i <= steps; ++i) {
      const Complex shape = (1.0 - j0(b * (static_cast<double>(i) / steps)) / at_wall) / whole;
      values_[static_cast<size_t>(i)] += 100 / area_mm2 * std::real(now * shape);
    }
  }
}

double VelocityProfile::at(double radius_mm) const {
  const double place = radius_mm / radius_mm_ * steps;
  if (place >= steps) return 0;
  const auto low = static_cast<size_t>(place);
  const double share = place - static_cast<double>(low);
  return (1 - share) * values_[low] + share * values_[low + 1];
}

}  // namespace diastole::scanner
