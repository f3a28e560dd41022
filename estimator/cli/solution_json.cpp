#include "estimator/cli/solution_json.hpp"

#include <string>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/force_balance.hpp"

namespace diastole {
namespace {

nlohmann::ordered_json triple(const Eigen::Vector3d& vector) { return {vector[0], vector[1], vector[2]}; }

nlohmann::ordered_json forces_of(const ElasticModel& model, const ElasticState& state) {
  const ForceBalance balance = force_balance(model.system(), state);
  nlohmann::ordered_json json;
  for (const SupportForce& support : balance.supports)
    json["supports_N"][std::string(support.face)] = triple(support.force_N);
  json["cavity_N"] = triple(balance.cavity_N);
  if (model.system().chamber()) json["chamber_N"] = triple(balance.chamber_N);
  json["unbalanced_N"] = balance.unbalanced_N.norm();
  return json;
}

}  // namespace

void add_equilibrium(nlohmann::ordered_json& json, ElasticModel& model, const ElasticState& state) {
  constexpr double mL_per_mm3 = 1e-3;
  json["pressure_kPa"] = state.pressure_kPa;
  json["cavity_volume_mL"] = nullptr;
  json["cavity_volume_change_mL"] = nullptr;
  if (model.system().cavity_closed()) {
    const double loaded_mL = model.cavity_volume_mL(state);
    json["cavity_volume_mL"] = loaded_mL;
    json["cavity_volume_change_mL"] = loaded_mL - model.cavity_volume_mL(model.rest_state());
  }
  if (model.system().chamber()) {
    json["chamber_pressure_kPa"] = state.chamber_pressure_kPa;
    json["chamber_intake_mL"] = mL_per_mm3 * model.system().chamber_intake_mm3(state);
  }
  json["stored_energy_mJ"] = model.stored_energy_mJ(state);
  json["forces"] = forces_of(model, state);
}

}  // namespace diastole
