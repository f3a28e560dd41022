#include "estimator/rig/pump_end.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::rig {
namespace {

/// Conductances below this are none: the resistance would be beyond what the step's matrix bears.
constexpr double least_leak = 1e-7;
/// A rigid end that leaks otherwise than in proportion has this conductance at least, so that it has a pressure while that is shut: of
/// a stroke it takes less than a ten-thousandth of a millilitre.
constexpr double never_shut_mL_s_kPa = 1e-6;

/// Of drive and gas, mL/kPa: less is rigid. A stiff hose yields 1e-3, and its waves shift by as much as the drive adds to that; so little moves the
/// pump's pressure by less than a pascal, so that a search does not see the border.
constexpr double least_compliance = 1e-8;
/// The drive's resistance over its stiffness: screw and seal rub, so that it does not ring with the fluid's end at a hundred hertz,
/// which samples would show as something slow.
constexpr double drive_damping_s = 2e-3;
/// Gas that is less rings against the fluid's end faster than anybody can see, and is as well damped by friction as the drive.
constexpr double least_undamped_gas_mL = 0.05;

/// Where a function is zero that grows by `slope` or more (or by less: then it takes longer), from `near` on. Regula falsi (Illinois).
template <class Function>
double root_of(const Function& function, double near, double slope, double close) {
  double a = near;
  double at_a = function(a);
  if (!std::isfinite(at_a)) at_a = function(a = 0.0);
  if (std::abs(at_a) <= close) return a;
  double reach = -at_a / slope;
  double b = a + reach;
  double at_b = function(b);
  constexpr int most_steps = 60;
  for (int step = 0; step < most_steps && at_a * at_b > 0.0; ++step) {
    a = b;
    at_a = at_b;
    at_b = function(b += reach *= 2.0);
  }
  for (int step = 0; step < most_steps && !std::isfinite(at_b); ++step) {
    const double middle = 0.5 * (a + b);
    const double there = function(middle);
    const bool is_beyond = !(there * at_a > 0.0);
    (is_beyond ? b : a) = middle;
    (is_beyond ? at_b : at_a) = there;
  }
  for (int step = 0; step < most_steps && std::abs(at_b) > close; ++step) {
    const double next = b - at_b * (b - a) / (at_b - at_a);
    if (!std::isfinite(next)) break;
    const double there = function(next);
    if (there * at_b < 0.0) {
      a = b;
      at_a = at_b;
    } else {
      at_a *= 0.5;
    }
    b = next;
    at_b = there;
  }
  return b;
}

}  // namespace

PumpEnd::PumpEnd(const RigModel& model, const RunPlace& place, double step_s)
    : step_s_(step_s),
      compliance_mL_per_kPa_(model.drive_compliance_mL_per_kPa),
      gas_(model.pump_gas_mL, model.gas_exponent, place.atmosphere_kPa),
      conductance_mL_s_kPa_(model.pump_leak_mL_s_kPa) {
  for (const LeakMaker& make : model.pump_leaks)
    leaks_.push_back(make(place));
  const double both = compliance_mL_per_kPa_ + gas_.compliance_at_rest();
  springs_ = both > least_compliance;
  if (springs_) {
    const double undamped =
        GasPocket(least_undamped_gas_mL, model.gas_exponent, place.atmosphere_kPa).compliance_at_rest();
    const double damped = std::max(compliance_mL_per_kPa_, undamped - gas_.compliance_at_rest());
    damping_s_ = drive_damping_s * std::min(1.0, damped / both);
    leaking_s_ = damping_s_ + 0.5 * step_s;
    linear_ = both + leaking_s_ * conductance_mL_s_kPa_;
    return;
  }
  if (leaks()) conductance_mL_s_kPa_ = std::max(conductance_mL_s_kPa_, never_shut_mL_s_kPa);
  if (conductance_mL_s_kPa_ > least_leak) linear_ = conductance_mL_s_kPa_;
}

std::optional<double> PumpEnd::stiffness() const {
  if (!springs_) return {};
  return 1.0 / linear_;
}

std::optional<double> PumpEnd::resistance() const {
  if (linear_ == 0.0) return {};
  return springs_ ? damping_s_ / linear_ : 1.0 / linear_;
}

double PumpEnd::leaks_beyond(double pressure_kPa, double time_s) const {
  double flow = 0.0;
  for (const LeakLaw& leak : leaks_)
    flow += leak(pressure_kPa, time_s);
  return flow;
}

double PumpEnd::absorbed_mL(double yielded_mL, double yielding_mL_per_s) const {
  return springs_ ? -yielded_mL - damping_s_ * yielding_mL_per_s : -yielding_mL_per_s;
}

double PumpEnd::pressure_kPa(double absorbed_mL, double beside_mL_per_kPa, double near_kPa,
                             double time_s) const {
  const bool has_gas = springs_ && gas_.present();
  const double compliance =
      (springs_ ? compliance_mL_per_kPa_ : 0.0) + leaking_s_ * conductance_mL_s_kPa_ + beside_mL_per_kPa;
  if (!leaks()) return has_gas ? gas_.pressure_behind_kPa(absorbed_mL, compliance) : absorbed_mL / compliance;
  constexpr double close = 1e-13;
  return root_of(
      [&](double pressure_kPa) {
        return compliance * pressure_kPa + (has_gas ? gas_.squeezed_mL(pressure_kPa) : 0.0) +
               leaking_s_ * leaks_beyond(pressure_kPa, time_s) - absorbed_mL;
      },
      near_kPa, compliance, close * (std::abs(absorbed_mL) + 1e-9));
}

double PumpEnd::load_kPa(double yielded_mL, double yielding_mL_per_s, double time_s) const {
  if (linear_ == 0.0) return 0.0;
  const double absorbed = absorbed_mL(yielded_mL, yielding_mL_per_s);
  return pressure_kPa(absorbed - leaked_mL_, 0.0, 0.0, time_s) - absorbed / linear_;
}

double PumpEnd::missing_load_kPa(double yielded_mL, double yielding_mL_per_s, double load_kPa,
                                 const YieldByLoad& by_load, double time_s) const {
  // A load L = p - A / linear makes it A = absorbed - given (L - load): in p, A = without - beside p.
  const double absorbed = absorbed_mL(yielded_mL, yielding_mL_per_s);
  const double given = -absorbed_mL(by_load.mL_per_kPa, by_load.mL_per_s_kPa);
  const double part = 1.0 - given / linear_;
  const double without = (absorbed + given * load_kPa) / part;
  const double beside = given / part;
  const double pressure = pressure_kPa(without - leaked_mL_, beside, load_kPa + absorbed / linear_, time_s);
  return pressure - (without - beside * pressure) / linear_ - load_kPa;
}

void PumpEnd::pass(double cylinder_kPa, double time_s) {
  if (!springs_) return;
  leaked_mL_ += step_s_ * (conductance_mL_s_kPa_ * cylinder_kPa + leaks_beyond(cylinder_kPa, time_s));
}

}  // namespace diastole::rig
