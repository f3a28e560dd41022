#include "estimator/fit/constrained_energy.hpp"

#include <numeric>

namespace diastole {
namespace {

constexpr double mJ_per_uJ = 1e-3;

}  // namespace

double constrained_energy_mJ(const ElasticModel& model, const ElasticState& state) {
  const SystemResidual residual = model.system().residual(state);
  const auto constraint = residual.values.begin() +
                          static_cast<std::ptrdiff_t>(model.system().equations().displacement_unknowns());
  const double at_rest_uJ = model.system().residual(model.rest_state()).energy_uJ;
  return mJ_per_uJ * std::inner_product(state.lagrange_pressure_kPa.begin(),
                                        state.lagrange_pressure_kPa.end(), constraint,
                                        residual.energy_uJ - at_rest_uJ);
}

double pressure_work_mJ(const ElasticModel& model, const ElasticState& state, const NodeField& change_mm) {
  const NodeField force = model.system().nodal_forces(state).cavity;
  return mJ_per_uJ * std::inner_product(force.begin(), force.end(), change_mm.begin(), 0.0);
}

}  // namespace diastole
