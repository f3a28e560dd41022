#pragma once
// A catheter with its transducer as a system of second order, and up to which frequency it can be trusted.
//
//   H(f) = 1 / (1 - r^2 + 2 i zeta r),   r = f / f0
//   unit step: s(t) = 1 - exp(-zeta w t) (cos(x t) + (zeta w / x) sin(x t)),   w = 2 pi f0,  x = w sqrt(1 - zeta^2),
// with hyperbolic functions where zeta > 1.
//
// The paper found its catheter "flat with minimal lag to 30 Hz, above which appreciable lag and attenuation were
// observed". Here that is two figures: where the amplitude is down to 1/sqrt 2 of the static one (-3 dB), and where the
// lag has grown to 5 % of the signal's period (18 degrees).

namespace diastole::signal {

struct SecondOrder {
  double f0_Hz = 0;  ///< natural frequency, undamped
  double zeta = 0;   ///< damping ratio
};

/// s(t); 0 before t = 0.
double unit_step(const SecondOrder& system, double t_s);

double amplitude_at(const SecondOrder& system, double frequency_Hz);
/// Of the output behind the input, in parts of the period: 0 to 0.5.
double lag_periods_at(const SecondOrder& system, double frequency_Hz);

/// (1 - r^2)^2 + (2 zeta r)^2 = 2.
double minus_3dB_Hz(const SecondOrder& system);
/// lag_periods_at = 0.05: tan 18 deg = 2 zeta r / (1 - r^2).
double lag_limit_Hz(const SecondOrder& system);
/// The least frequency at which the amplitude is 5 % off the static one, above or below.
double flat_limit_Hz(const SecondOrder& system);
/// Delay of slow signals: zeta / (pi f0).
double delay_s(const SecondOrder& system);

}  // namespace diastole::signal
