#include "estimator/rig/pump_end.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::rig {
namespace {

/// Conductances below this are none: the resistance would be beyond what the step's matrix bears.
constexpr double least_leak = 1e-7;

/// Of drive and gas, mL/kPa: less is rigid. A stiff hose yields 1e-3, and its waves shift by as much as the drive adds to that; so little moves the
/// pump's pressure by less than a pascal, so that a search does not see the border.
constexpr double least_compliance = 1e-8;
/// The drive's resistance over its stiffness: screw and seal rub, so that it does not ring with the fluid's end at a hundred hertz,
/// which samples would show as something slow.
constexpr double drive_damping_s = 2e-3;
/// Gas that is less rings against the fluid's end faster than anybody can see, and is as well damped by friction as the drive.
constexpr double least_undamped_gas_mL = 0.05;

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
  } else if (conductance_mL_s_kPa_ > least_leak) {
    linear_ = conductance_mL_s_kPa_;
  }
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

double PumpEnd::pressure_kPa(double absorbed_mL, double time_s) const {
  const bool has_gas = springs_ && gas_.present();
  const double compliance = (springs_ ? compliance_mL_per_kPa_ : 0.0) + leaking_s_ * conductance_mL_s_kPa_;
  if (leaks_.empty())
    return has_gas ? gas_.pressure_behind_kPa(absorbed_mL, compliance) : absorbed_mL / compliance;
  const auto excess = [&](double pressure_kPa) {
    return compliance * pressure_kPa + (has_gas ? gas_.squeezed_mL(pressure_kPa) : 0.0) +
           leaking_s_ * leaks_beyond(pressure_kPa, time_s) - absorbed_mL;
  };
  // Between none and the linear end's, where all leaks grow with pressure. Regula falsi (Illinois).
  double a = 0.0;
  double b = absorbed_mL / linear_;
  double at_a = excess(a);
  double at_b = excess(b);
  constexpr double close = 1e-13;
  for (int doubling = 0; doubling < 8 && at_a * at_b > 0.0; ++doubling)
    at_b = excess(b *= 2.0);
  for (int step = 0; step < 60 && std::abs(at_b) > close * (std::abs(absorbed_mL) + 1e-9); ++step) {
    const double next = b - at_b * (b - a) / (at_b - at_a);
    const double at_next = excess(next);
    if (at_next * at_b < 0.0) {
      a = b;
      at_a = at_b;
    } else {
      at_a *= 0.5;
    }
    b = next;
    at_b = at_next;
    if (!std::isfinite(b)) break;
  }
  return b;
}

double PumpEnd::load_kPa(double yielded_mL, double yielding_mL_per_s, double time_s) const {
  if (linear_ == 0.0) return 0.0;
  if (!springs_) return pressure_kPa(-yielding_mL_per_s, time_s) + yielding_mL_per_s / linear_;
  const double absorbed_mL = -yielded_mL - damping_s_ * yielding_mL_per_s;
  return pressure_kPa(absorbed_mL - leaked_mL_, time_s) - absorbed_mL / linear_;
}

void PumpEnd::pass(double cylinder_kPa, double time_s) {
  if (!springs_) return;
  leaked_mL_ += step_s_ * (conductance_mL_s_kPa_ * cylinder_kPa + leaks_beyond(cylinder_kPa, time_s));
}

}  // namespace diastole::rig
