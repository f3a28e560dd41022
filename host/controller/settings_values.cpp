#include "host/controller/settings_values.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

using wire::MachineSettings;

struct Entry {
  SettingWords words;
  int32_t MachineSettings::*value;
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all{
#define DIASTOLE_SETTING(number, name, least, initial, most, shown, scale, explanation)        \
  Entry{{wire::Setting::name, shown, scale, (least) * (scale), (most) * (scale), explanation}, \
        &MachineSettings::name},
#include "protocol/wire/setting_list.inc"
  };
  return all;
}

double shown(const Entry& entry, const MachineSettings& settings) {
  return entry.words.scale * settings.*entry.value;
}

[[noreturn]] void refuse(const std::string& name, const std::string& problem, const std::string& remedy) {
  throw InputError({"controller settings", name, problem, remedy});
}

double number_of(const runfile::Attribute& value) {
  if (const auto* whole = std::get_if<int64_t>(&value)) return static_cast<double>(*whole);
  return std::get<double>(value);
}

void set_name(MachineSettings& settings, const runfile::Attribute& value) {
  if (!std::holds_alternative<std::string>(value))
    refuse("board_name", fmt::format("{} is no text", number_of(value)), "Give a name in quotes.");
  const auto& text = std::get<std::string>(value);
  if (text.size() > MachineSettings::kMaxNameBytes) {
    refuse("board_name", fmt::format("\"{}\" has {} bytes", text, text.size()),
           fmt::format("At most {} are kept.", MachineSettings::kMaxNameBytes));
  }
  settings.board_name = {};
  std::copy(text.begin(), text.end(), settings.board_name.begin());
  settings.board_name_size = static_cast<uint8_t>(text.size());
}

void set_number(MachineSettings& settings, const Entry& entry, const runfile::Attribute& value) {
  const SettingWords& words = entry.words;
  if (const auto* text = std::get_if<std::string>(&value))
    refuse(words.name, fmt::format("\"{}\" is no number", *text), "Give a number.");
  const double asked = number_of(value);
  if (!(asked >= words.least - 1e-9 && asked <= words.most + 1e-9)) {
    refuse(words.name, fmt::format("is {:g}; {:g} to {:g} are possible", asked, words.least, words.most),
           fmt::format("Its meaning: {}.", words.explanation));
  }
  const double whole = std::round(asked / words.scale);
  if (std::abs(whole * words.scale - asked) > 1e-6 * std::max(1.0, std::abs(asked))) {
    refuse(words.name, fmt::format("is {}, and is kept in steps of {:g}", asked, words.scale),
           fmt::format("Give {:.10g}.", whole * words.scale));
  }
  settings.*entry.value = static_cast<int32_t>(whole);
}

/// What a rig file and the settings both know.
struct Shared {
  const char* setting;
  const char* place;
  double in_rig;
};

}  // namespace

const std::vector<SettingWords>& setting_words() {
  static const std::vector<SettingWords> all = [] {
    std::vector<SettingWords> words;
    for (const Entry& entry : entries())
      words.push_back(entry.words);
    return words;
  }();
  return all;
}

Attributes settings_values(const MachineSettings& settings) {
  Attributes values;
  for (const Entry& entry : entries()) {
    if (entry.words.scale == 1)
      values[entry.words.name] = int64_t{settings.*entry.value};
    else  // the shortest decimal number, not the nearest product
      values[entry.words.name] = std::stod(fmt::format("{:.10g}", shown(entry, settings)));
  }
  values["board_name"] =
      std::string(settings.board_name.begin(), settings.board_name.begin() + settings.board_name_size);
  return values;
}

void change_settings(MachineSettings& settings, const Attributes& changes) {
  for (const auto& [name, value] : changes) {
    if (name == "board_name") {
      set_name(settings, value);
      continue;
    }
    const auto found =
        std::find_if(entries().begin(), entries().end(),
                     [&, &wanted = name](const Entry& entry) { return entry.words.name == wanted; });
    if (found == entries().end()) {
      std::vector<std::string> known{"board_name"};
      for (const Entry& entry : entries())
        known.push_back(entry.words.name);
      refuse(name, "there is no such setting",
             fmt::format("{}There are {}.", did_you_mean(name, known), fmt::join(known, ", ")));
    }
    set_number(settings, *found, value);
  }
}

std::optional<InputFault> disagreement(const RigConfig& rig, const MachineSettings& settings) {
  const Attributes own = settings_values(settings);
  const auto in_rig = [&](const char* key) { return number_of(rig.attributes.at(key)); };
  const std::array shared{
      Shared{"microsteps", "controller.microsteps", static_cast<double>(rig.controller.microsteps)},
      Shared{"steps_per_rev", "rig.steps_per_rev", in_rig("steps_per_rev")},
      Shared{"bore_mm", "rig.bore_mm", in_rig("bore_mm")},
      Shared{"screw_rev_per_cm", "rig.screw_rev_per_cm", in_rig("screw_rev_per_cm")},
  };
  for (const Shared& each : shared) {
    const double in_controller = number_of(own.at(each.setting));
    if (std::abs(each.in_rig - in_controller) <= 1e-5 * std::abs(in_controller)) continue;
    return InputFault{
        rig.file, each.place,
        fmt::format("is {:g}, and {} in the settings kept in the controller is {:g}", each.in_rig,
                    each.setting, in_controller),
        fmt::format("Nothing moves until they agree: correct the rig file and restart the daemon, or "
                    "write the controller's settings: diastole settings --set {}={:g}",
                    each.setting, each.in_rig)};
  }
  const double travel_mL = 1e-3 * static_cast<double>(wire::travel_uL(settings));
  if (rig.controller.limits.travel_mL > travel_mL) {
    return InputFault{
        rig.file, "controller.limits.travel_mL",
        fmt::format("is {:g}, and travel_mm = {:g} in the settings kept in the controller allows {:g} mL",
                    rig.controller.limits.travel_mL, 1e-3 * settings.travel_um, travel_mL),
        "Lower it, or correct the setting: diastole settings --set travel_mm=..."};
  }
  const double rate_Hz = static_cast<double>(settings.full_step_rate_Hz) * settings.microsteps;
  if (rig.controller.limits.step_rate_Hz > rate_Hz) {
    return InputFault{rig.file, "controller.limits.step_rate_Hz",
                      fmt::format("is {:g}, and full_step_rate_Hz = {} in the settings kept in the "
                                  "controller allows {:g} microsteps/s",
                                  rig.controller.limits.step_rate_Hz, settings.full_step_rate_Hz, rate_Hz),
                      "Lower it, or correct the setting: diastole settings --set full_step_rate_Hz=..."};
  }
  return std::nullopt;
}

}  // namespace diastole
