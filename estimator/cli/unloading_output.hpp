#pragma once
// What `--unload` found, as `diastole solve` prints it.

#include <nlohmann/json.hpp>

#include "estimator/model/unloaded_model.hpp"

namespace diastole {

nlohmann::ordered_json unloading_json(const UnloadedModel& unloaded);
/// For people. Precondition: there is an unloaded shape.
void print_unloading(const nlohmann::ordered_json& json, double imaged_at_kPa);

}  // namespace diastole
