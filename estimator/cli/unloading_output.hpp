#pragma once
// What `--unload` found, as `diastole solve` and `diastole fit` print it.

#include <nlohmann/json.hpp>

#include <string>

#include "estimator/io/fit_file.hpp"
#include "estimator/model/unloaded_model.hpp"

namespace diastole {

nlohmann::ordered_json unloading_json(const UnloadedModel& unloaded);
/// For people. Precondition: there is an unloaded shape.
void print_unloading(const nlohmann::ordered_json& json, double imaged_at_kPa);
/// A fit's. That the load brings the image back is said only where it does.
std::string unloading_sentence(const FittedUnloading& unloaded);

}  // namespace diastole
