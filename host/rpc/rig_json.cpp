#include "host/rpc/rig_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "host/controller/controller_words.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(KeptJournals, directory, count, bytes, without_run_file, keep_days)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ChannelReading, name, samples, mean_V, noise_kPa, drift_kPa, points,
                                   kPa_per_V, zero_V)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CalibrationReport, file, channels)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunBegun, run_id, journal, run_file)

namespace {

using nlohmann::json;

json or_null(const auto& value) { return value ? json(*value) : json(); }

json array_of(const auto& values, auto as_element) {
  json array = json::array();
  for (const auto& each : values)
    array.push_back(as_element(each));
  return array;
}

/// Names of the bits that are set in wire::Status::inputs; an input is active when pressed, closed or unplugged.
json active_inputs(uint8_t bits) {
  constexpr std::array names{"estop", "home", "far_limit"};
  json active = json::array();
  for (size_t i = 0; i < names.size(); ++i)
    if ((bits >> i & 1U) != 0) active.push_back(names[i]);
  return active;
}

json object_of(const RigStatus& status) {
  const wire::Status& controller = status.controller;
  const wire::Fault fault = controller.fault;
  const wire::Hello& firmware = status.firmware;
  json object{DIASTOLE_NAMED(status, state, position_mL, instrument, journals),
              {"fault", fault == wire::Fault::none ? json() : json(wire::fault_name(fault))},
              {"fault_number", static_cast<int>(fault)},
              {"fault_text", wire::fault_explanation(fault)},
              {"remedy", wire::fault_remedy(fault)},
              {"firmware", fmt::format("{}.{}.{}", firmware.version_major, firmware.version_minor,
                                       firmware.version_patch)},
              {"takes_unsigned_firmware", controller.takes_unsigned_firmware != 0},
              {"board", firmware.board_id},
              {"boot_id", firmware.boot_id},
              {"inputs", active_inputs(controller.inputs)},
              {"motor_powered", (controller.inputs & 8U) != 0},
              DIASTOLE_NAMED(controller, segment, triggers, r_waves, steps),
              {"cycles", controller.cycle},
              {"link", {DIASTOLE_NAMED(controller, crc_errors, retransmissions)}},
              {"settings_problem", or_null(status.settings_problem)},
              {"controller", status.port},
              {"notice", or_null(status.notice)}};
  if (!status.run_id.empty()) object["run_id"] = status.run_id;
  if (status.jog) {
    object["jogged_mL"] = status.jog->jogged_mL;
    object["stopped"] = status.jog->stopped;
  }
  return object;
}

json object_of(const SettingsReport& report) {
  json settings = json::object();
  for (const auto& [name, value] : report.settings)
    std::visit([&settings, &at = name](const auto& v) { settings[at] = v; }, value);
  return {DIASTOLE_NAMED(report, record, microstep_uL, backlash_microsteps),
          {"settings", settings},
          {"problem", or_null(report.problem)}};
}

json object_of(const BlackBox& box) {
  const auto entry = [&](const wire::BlackBoxEntry& each) -> json {
    json found{DIASTOLE_NAMED(each, number, boot),
               {"time_s", static_cast<double>(each.tick) / box.tick_rate_Hz},
               {"kind", wire::noted_name(each.kind)},
               {"text", in_words(each)}};
    if (each.kind == wire::Noted::crash) {
      found["register"] = wire::crash_register_name(static_cast<wire::CrashRegister>(each.detail));
      found["value"] = static_cast<uint32_t>(each.argument);
    }
    return found;
  };
  const bool since_power_on = !box.entries.empty() && box.entries.front().number == 1;
  return {{"entries", array_of(box.entries, entry)}, {"since_power_on", since_power_on}};
}

json object_of(const CalibrationReport& report) { return report; }

json object_of(const SelfTestResult& result) {
  const auto check = [](const SelfTestCheck& each) -> json {
    return {DIASTOLE_NAMED(each, name, what, least, most, unit, remedy),
            {"measured", or_null(each.measured)},
            {"passed", each.passed()}};
  };
  return {{"passed", std::ranges::all_of(result.checks, &SelfTestCheck::passed)},
          {"checks", array_of(result.checks, check)}};
}

json object_of(const RunBegun& run) { return run; }

json object_of(const RunResult& result) {
  if (result.run_file.empty()) return {DIASTOLE_NAMED(result, end, problem, journal)};
  return {DIASTOLE_NAMED(result, end, regular, journal, run_file, cycles, triggers, samples, gaps, errors,
                         expected)};
}

json object_of(const RemarkLog::Entry& entry) {
  return {DIASTOLE_NAMED(entry, number, utc), DIASTOLE_NAMED(entry.remark, level, code, text)};
}

json rounded(double value) {
  if (std::isnan(value)) return nullptr;
  return std::round(1e4 * value) / 1e4;
}

}  // namespace

json as_json(const RigAnswer& answer) {
  return std::visit([](const auto& each) { return object_of(each); }, answer);
}

json as_json(const std::optional<RunState>& run) {
  if (!run) return nullptr;
  const RunProgress& progress = run->progress;
  return {{"run_id", run->plan.run_id},
          {"state", run->state},
          {"planned_s", run->plan.estimate_s},
          {"planned_cycles", run->plan.planned_cycles},
          DIASTOLE_NAMED(progress, received, missing, saturated, triggers, last_kPa, filtered_kPa),
          {"gate_pulses", or_null(progress.gate_pulses)},
          {"schedule", or_null(progress.schedule)},
          {"remarks", array_of(run->remarks.remarks, [](const auto& each) { return object_of(each); })},
          {"next_remark", run->remarks.next},
          {"result", run->result ? object_of(*run->result) : json()}};
}

json as_json(const LiveTrace::Excerpt& excerpt) {
  const auto column = [&](double LiveTrace::Row::*member) {
    return array_of(excerpt.rows, [&](const LiveTrace::Row& row) { return rounded(row.*member); });
  };
  return {DIASTOLE_NAMED(excerpt, run_id, first_row, first_trigger),
          {"time_s", column(&LiveTrace::Row::time_s)},
          {"kPa", column(&LiveTrace::Row::kPa)},
          {"filtered_kPa", column(&LiveTrace::Row::filtered_kPa)},
          {"trigger_s", array_of(excerpt.trigger_s, rounded)}};
}

json as_json(const std::optional<ContinuedSlice>& continued) {
  if (!continued) return {{"continued", false}};
  return {{"continued", true}, DIASTOLE_NAMED(*continued, slice, prompt)};
}

Attributes settings_in(const json& object) {
  Attributes values;
  for (const auto& [name, value] : object.items()) {
    if (value.is_string()) {
      values[name] = value.get<std::string>();
    } else if (value.is_number()) {
      values[name] = value.get<double>();
    } else {
      throw InputError({"controller settings", name, value.dump() + " is no number",
                        "Give a number, or a text in quotes."});
    }
  }
  return values;
}

}  // namespace diastole
