#pragma once
// The controller's settings (protocol/wire/setting_list.inc) in the names and units that people use.

#include <optional>
#include <string>
#include <vector>

#include "host/config/rig_config.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/machine_settings.hpp"

namespace diastole {

/// One number among the settings as people see it.
struct SettingWords {
  wire::Setting number{};
  std::string name;  ///< with its unit, "backlash_um"
  double scale = 1;  ///< times the value on the wire
  double least = 0;
  double most = 0;
  std::string explanation;
};
const std::vector<SettingWords>& setting_words();

/// {"microsteps", 8}, ..., {"board_name", "..."}
Attributes settings_values(const wire::MachineSettings& settings);

/// Sets what `changes` names, leaving the rest. Throws InputError with name, value and what is allowed.
void change_settings(wire::MachineSettings& settings, const Attributes& changes);

/// Where the rig file disagrees with settings that were written: both values, and the remedy. Nothing if they agree.
std::optional<InputFault> disagreement(const RigConfig& rig, const wire::MachineSettings& settings);

}  // namespace diastole
