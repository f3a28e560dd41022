#pragma once
// What can be asked of the daemon: one function a method, in one table.

#include <exception>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string_view>

#include "host/rig/rig.hpp"

namespace diastole {

/// anybody: observers too. controller: who holds the control lease, or gets it because it is free.
enum class Access { anybody, controller };

using Reply = std::function<void(const std::exception_ptr& error, const nlohmann::json& result)>;

struct Method {
  std::string_view name;
  Access access;
  /// Calls `reply` once, now or later and on any thread; or throws rpc::Error, RigBusy, InputError or HardwareError.
  void (*act)(Rig& rig, const nlohmann::json& params, const Reply& reply);
};

std::span<const Method> methods();
/// Null if there is none of that name.
const Method* find_method(std::string_view name);

}  // namespace diastole
