#include "estimator/fit/motion_model.hpp"

#include <stdexcept>

namespace diastole {

std::vector<MotionOutcome> MotionModel::solve_all(std::span<const double> values,
                                                  std::span<const double> pressures_kPa) {
  std::vector<MotionOutcome> outcomes;
  for (size_t slot = 0; slot < pressures_kPa.size(); ++slot) {
    outcomes.push_back(solve(slot, values, pressures_kPa[slot]));
    if (!outcomes.back().position_mm) break;
  }
  return outcomes;
}

double MotionModel::stored_energy_mJ(size_t) { throw std::logic_error("a model without an energy"); }

EnergyDerivatives MotionModel::energy_derivatives(size_t) {
  throw std::logic_error("a model without an energy");
}

}  // namespace diastole
