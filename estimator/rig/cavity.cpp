#include "estimator/rig/cavity.hpp"

namespace diastole::rig {

Cavity::Cavity(const RigModel& model, const RunPlace& place)
    : model_(model), gas_(model.cavity_gas_mL, model.gas_exponent, place.atmosphere_kPa) {
  for (const MemoryMaker& make : model.memories)
    memories_.push_back(make(place));
  for (const LeakMaker& make : model.cavity_leaks)
    leaks_.push_back(make(place));
}

double Cavity::pressure_kPa(double specimen_mL, double time_s) {
  elastic_kPa_ = model_.modulus_kPa * model_.curve.at(specimen_mL).pressure_kPa;
  double pressure = elastic_kPa_;
  for (const auto& memory : memories_)
    pressure = memory->look(pressure, specimen_mL, time_s);
  return pressure;
}

double Cavity::look(double arrived_mL, double time_s) {
  const double held = arrived_mL - lost_mL_ - leak_mL_per_s_ * (begun_ ? time_s - passed_s_ : 0.0);
  time_s_ = time_s;
  if (!gas_.present()) {
    specimen_mL_ = held;
    pressure_kPa_ = pressure_kPa(held, time_s);
    return pressure_kPa_;
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
  pressure_kPa_ = pressure_kPa(b, time_s);
  return pressure_kPa_;
}

void Cavity::pass() {
  if (begun_) lost_mL_ += leak_mL_per_s_ * (time_s_ - passed_s_);
  leak_mL_per_s_ = 0.0;
  for (const LeakLaw& leak : leaks_)
    leak_mL_per_s_ += leak(pressure_kPa_, time_s_);
  double pressure = elastic_kPa_;
  for (const auto& memory : memories_) {
    const double given = pressure;
    pressure = memory->look(given, specimen_mL_, time_s_);
    memory->pass(given, specimen_mL_, time_s_);
  }
  passed_s_ = time_s_;
  begun_ = true;
}

}  // namespace diastole::rig
