#include "tools/sim_rig/plant/specimen.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::sim_rig {

double Specimen::pressure_kPa(double inflation_mL) const {
  double pressure = scale_ * gel_.pressure_kPa(inflation_mL) + flaws_.chamber_kPa_mL * inflation_mL;
  for (size_t i = 0; i < relaxed_kPa_.size(); ++i)
    pressure -= flaws_.relaxing[i] * relaxed_kPa_[i];
  return pressure;
}

double Specimen::stiffness_kPa_per_mL(double inflation_mL) const {
  return scale_ * gel_.stiffness_kPa_per_mL(inflation_mL) + flaws_.chamber_kPa_mL;
}

void Specimen::pass(double inflation_mL, double step_s) {
  const double elastic_kPa = scale_ * gel_.pressure_kPa(inflation_mL);
  for (size_t i = 0; i < relaxed_kPa_.size(); ++i)
    relaxed_kPa_[i] += (elastic_kPa - relaxed_kPa_[i]) * -std::expm1(-step_s / flaws_.relaxing_s[i]);
  largest_mL_ = std::max(largest_mL_, inflation_mL);
  if (cycle_ == 0) return;
  since_first_cycle_s_ += step_s;
  const double softened = flaws_.softening * -std::expm1(-(cycle_ - 1) / flaws_.softening_cycles) *
                          -std::expm1(-largest_mL_ / flaws_.softening_V0_mL);
  const double warmed = flaws_.warming * -std::expm1(-since_first_cycle_s_ / flaws_.warming_s);
  scale_ = (1 - softened) * (1 + warmed);
}

}  // namespace diastole::sim_rig
