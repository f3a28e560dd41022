#include "host/daemon/rig_json.hpp"

#include <nlohmann/json.hpp>

namespace diastole {

using nlohmann::json;

json values_as_json(const Attributes& values) {
  json object = json::object();
  for (const auto& [name, value] : values)
    std::visit([&object, &at = name](const auto& v) { object[at] = v; }, value);
  return object;
}

}  // namespace diastole
