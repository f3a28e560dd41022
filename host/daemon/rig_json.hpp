#pragma once
// What the rig answers, as JSON: the form in which clients of the daemon see it.

#include <nlohmann/json_fwd.hpp>

#include "host/config/rig_config.hpp"

namespace diastole {

nlohmann::json values_as_json(const Attributes& values);

}  // namespace diastole
