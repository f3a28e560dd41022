#pragma once
// A finding as it stands in the JSON of fits and reconstructions.

#include <nlohmann/json.hpp>

#include "estimator/io/finding.hpp"

namespace diastole {

/// A number that does not exist is null.
nlohmann::ordered_json from_finding(const Finding& finding);

/// Throws nlohmann::json::exception for a member that is missing or of another kind, std::invalid_argument for a
/// severity that there is not.
Finding to_finding(const nlohmann::ordered_json& json);

}  // namespace diastole
