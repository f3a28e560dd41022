#include "estimator/rig/cavity.hpp"

#include <cmath>

namespace diastole::rig {

Cavity::Cavity(const RigModel& model, const RunPlace& place)
    : model_(model), gas_(model.cavity_gas_mL, model.gas_exponent, place.atmosphere_kPa) {
  for (const MemoryMaker& make : model.memories)
    memories_.push_back(make(place));
}

double Cavity::pressure_kPa(double specimen_mL, double time_s) const {
  double pressure = model_.modulus_kPa * model_.curve.at(specimen_mL).pressure_kPa;
  for (const auto& memory : memories_)
    pressure = memory->look(pressure, specimen_mL, time_s);
  return pressure;
}

double Cavity::look(double arrived_mL, double time_s) {
  const double held = arrived_mL - lost_mL_ - leak_mL_per_s_ * (begun_ ? time_s - passed_s_ : 0.0);
  if (!gas_.present()) {
    specimen_mL_ = held;
    return pressure_kPa(held, time_s);
  }
  // specimen + squeezed(p(specimen)) = held, by a few secant steps from the last solution.
  double a = specimen_mL_;
  double at_a = a + gas_.squeezed_mL(pressure_kPa(a, time_s)) - held;
  double b = a - at_a;
  for (int step = 0; step < 8; ++step) {
    const double at_b = b + gas_.squeezed_mL(pressure_kPa(b, time_s)) - held;
    if (std::abs(at_b) < 1e-10 || at_b == at_a) break;
    const double next = b - at_b * (b - a) / (at_b - at_a);
    a = b;
    at_a = at_b;
    b = next;
  }
  specimen_mL_ = b;
  return pressure_kPa(b, time_s);
}

void Cavity::pass(double arrived_mL, double time_s) {
  double pressure = look(arrived_mL, time_s);
  if (begun_) lost_mL_ += leak_mL_per_s_ * (time_s - passed_s_);
  leak_mL_per_s_ = 0.0;
  for (const LeakLaw& leak : model_.cavity_leaks)
    leak_mL_per_s_ += leak(pressure, time_s);
  pressure = model_.modulus_kPa * model_.curve.at(specimen_mL_).pressure_kPa;
  for (const auto& memory : memories_) {
    const double given = pressure;
    pressure = memory->look(given, specimen_mL_, time_s);
    memory->pass(given, specimen_mL_, time_s);
  }
  passed_s_ = time_s;
  begun_ = true;
}

}  // namespace diastole::rig
