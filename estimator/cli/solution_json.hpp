#pragma once
// One equilibrium as --json documents hold it.

#include <nlohmann/json.hpp>

#include "estimator/fe/elastic_model.hpp"

namespace diastole {

/// Adds to `json`: cavity and chamber (pressures in kPa, volumes in mL), stored energies, and the forces of supports
/// and fluids in N, which add up to `unbalanced_N`. The cavity's volumes are null if it is open.
void add_equilibrium(nlohmann::ordered_json& json, ElasticModel& model, const ElasticState& state);

}  // namespace diastole
