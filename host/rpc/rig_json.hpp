#pragma once
// What the rig answers, as JSON: the form in which clients of the daemon see it (docs/daemon.md).

#include <nlohmann/json.hpp>

#include "host/acquisition/live_trace.hpp"
#include "host/rig/rig_answers.hpp"
#include "host/rig/run_monitor.hpp"

namespace diastole {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScheduleProgress, block, slice, slices, phase, cycles_left, prompt)

/// RigStatus: {"state", "fault", "fault_number", "firmware", "position_mL", "notice", ...}, after a jog "jogged_mL" and
/// "stopped" too. SettingsReport: {"record", "settings": {name: value}, "microstep_uL", "backlash_microsteps",
/// "problem"}. BlackBox: {"entries": [{"number", "boot", "time_s", "kind", "text"}], "since_power_on"}.
/// CalibrationReport: {"file", "channels": [{"name", "samples", "mean_V", ...}]}. RunBegun: {"run_id", "journal",
/// "run_file"}. SelfTestResult: {"passed", "checks": [{"name", "what", "passed", "measured" (null: nothing seen), "least", "most",
/// "unit", "remedy"}]}.
nlohmann::json as_json(const RigAnswer& answer);

/// {"run_id", "state": running|writing|done|failed, "planned_s", "planned_cycles", "received", "missing", "triggers",
/// "gate_pulses" (null if not counted), "last_kPa", "filtered_kPa", "schedule" (null without one), "remarks":
/// [{"number", "utc", "level", "code", "text"}], "next_remark": the number to ask for next, "result"}; null: no run.
nlohmann::json as_json(const std::optional<RunState>& run);

/// Columns, to a tenth of a millisecond and of a pascal; null: a sample is missing.
nlohmann::json as_json(const LiveTrace::Excerpt& excerpt);

/// {"continued"}, and if so {"slice", "prompt"}.
nlohmann::json as_json(const std::optional<ContinuedSlice>& continued);

/// {name: number or text} as values. Throws InputError for others.
Attributes settings_in(const nlohmann::json& object);

}  // namespace diastole
