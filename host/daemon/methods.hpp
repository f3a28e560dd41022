#pragma once
// What can be asked of the daemon: one function a method, one line each in method_list.inc.

#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "host/daemon/rig_service.hpp"

namespace diastole {

/// anybody: observers too. controller: who holds the control lease, or gets it because it is free.
enum class Access { anybody, controller };

struct Method {
  std::string_view name;
  Access access;
  /// Calls `done` once, now or later and on any thread; or throws rpc::Error, InputError or HardwareError.
  void (*act)(RigService& rig, const nlohmann::json& params, RigService::Done done);
};

std::span<const Method> methods();
/// Null if there is none of that name.
const Method* find_method(std::string_view name);

}  // namespace diastole
