#include "protocol/signal/step_response.hpp"

#include <cmath>
#include <complex>
#include <numbers>

namespace diastole::signal {
namespace {

using std::numbers::pi;

constexpr double lag_limit_periods = 0.05;
constexpr double flatness = 0.05;

/// r^2 where |H|^2 = 1/m: u^2 - 2 (1 - 2 zeta^2) u + 1 - m = 0 for u = r^2, the larger root; below 0: nowhere.
double squared_ratio(double zeta, double m, double sign) {
  const double b = 1 - 2 * zeta * zeta;
  const double discriminant = b * b + m - 1;
  return discriminant < 0 ? -1 : b + sign * std::sqrt(discriminant);
}

std::complex<double> response(const SecondOrder& system, double frequency_Hz) {
  const double r = frequency_Hz / system.f0_Hz;
  return 1.0 / std::complex<double>(1 - r * r, 2 * system.zeta * r);
}

}  // namespace

double unit_step(const SecondOrder& system, double t_s) {
  if (t_s <= 0) return 0;
  const double w = 2 * pi * system.f0_Hz;
  const double decay = system.zeta * w;
  const double x_squared = w * w * (1 - system.zeta * system.zeta);
  const double x = std::sqrt(std::abs(x_squared));
  if (x * t_s < 1e-6) return 1 - std::exp(-decay * t_s) * (1 + decay * t_s);
  if (x_squared > 0) {
    return 1 - std::exp(-decay * t_s) * (std::cos(x * t_s) + decay / x * std::sin(x * t_s));
  }
  const double slow = std::exp((x - decay) * t_s), fast = std::exp(-(x + decay) * t_s);
  return 1 - 0.5 * (slow + fast + decay / x * (slow - fast));
}

double amplitude_at(const SecondOrder& system, double frequency_Hz) {
  return std::abs(response(system, frequency_Hz));
}

double lag_periods_at(const SecondOrder& system, double frequency_Hz) {
  return -std::arg(response(system, frequency_Hz)) / (2 * pi);
}

double minus_3dB_Hz(const SecondOrder& system) {
  return system.f0_Hz * std::sqrt(squared_ratio(system.zeta, 2, 1));
}

double lag_limit_Hz(const SecondOrder& system) {
  const double tangent = std::tan(2 * pi * lag_limit_periods);
  return system.f0_Hz * (std::hypot(system.zeta, tangent) - system.zeta) / tangent;
}

double flat_limit_Hz(const SecondOrder& system) {
  const double above = squared_ratio(system.zeta, 1 / ((1 + flatness) * (1 + flatness)), -1);
  if (above > 0) return system.f0_Hz * std::sqrt(above);
  return system.f0_Hz * std::sqrt(squared_ratio(system.zeta, 1 / ((1 - flatness) * (1 - flatness)), 1));
}

double delay_s(const SecondOrder& system) { return system.zeta / (pi * system.f0_Hz); }

}  // namespace diastole::signal
