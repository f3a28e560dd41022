#include <fmt/format.h>

#include <cmath>

#include "host/controller/settings_values.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::replay {
namespace {

using runfile::RecordedRun;
using runfile::RunFile;

/// A number of the rig file, as recorded or as the built-in rig has it.
struct Geometry {
  const char* name;
  double fallback;
};
constexpr Geometry needed[] = {{"bore_mm", 100},       {"screw_rev_per_cm", 6.3},
                               {"steps_per_rev", 200}, {"hose_length_m", 5},
                               {"hose_bore_mm", 12},   {"fluid_density_kg_m3", 1005}};

std::string channel_table(const RecordedRun& run, const std::string& name, size_t input) {
  const double kPa_per_V = rig_number(run, name + "_kPa_per_V").value_or(4.0);
  const double zero_V = rig_number(run, name + "_zero_V").value_or(0);
  return fmt::format("[[daq.channel]]\nname = \"{}\"\ninput = {}\nkPa_per_V = {}\nzero_V = {}\n", name, input,
                     kPa_per_V, zero_V);
}

/// Of the recording's channels those that were measured: what was filtered is made anew.
std::string channel_tables(const RecordedRun& run) {
  constexpr std::string_view unit = "_kPa", filtered = "_filtered_kPa";
  std::string tables;
  size_t input = 0;
  for (const auto& [dataset, values] : run.pressure.channels) {
    if (!dataset.ends_with(unit) || dataset.ends_with(filtered)) continue;
    tables += channel_table(run, dataset.substr(0, dataset.size() - unit.size()), input++);
  }
  return tables;
}

MotionLimits limits_of(const RecordedRun& run, ReplayPlan& plan) {
  MotionLimits limits;
  bool complete = true;
  const auto take = [&](const char* name, double& limit) {
    if (const auto recorded = rig_number(run, name)) {
      limit = *recorded;
    } else {
      complete = false;
    }
  };
  take("limit_travel_mL", limits.travel_mL);
  take("limit_flow_mL_s", limits.flow_mL_s);
  take("limit_acceleration_mL_s2", limits.acceleration_mL_s2);
  take("limit_step_rate_Hz", limits.step_rate_Hz);
  take("limit_pressure_kPa", limits.pressure_kPa);
  limits.cavity_kPa =
      rig_number(run, "limit_cavity_kPa").value_or(limits.cavity_kPa);  // files before it lack it
  if (!complete) {
    plan.remarks.emplace_back(
        "the file does not hold the controller's limits: the usual ones are assumed (--config RIG gives "
        "others)");
  }
  return limits;
}

int64_t microsteps_of(const RecordedRun& run) {
  return std::llround(rig_number(run, "microsteps").value_or(8));
}

std::string controller_table(const RecordedRun& run, const MotionLimits& limits) {
  return fmt::format(
      "[controller]\nport = \"unused\"\nmicrosteps = {}\nlease_ms = {}\n[controller.limits]\ntravel_mL = {}\n"
      "flow_mL_s = {}\nacceleration_mL_s2 = {}\nstep_rate_Hz = {}\npressure_kPa = {}\ncavity_kPa = {}\n",
      microsteps_of(run), std::llround(rig_number(run, "lease_ms").value_or(500)), limits.travel_mL,
      limits.flow_mL_s, limits.acceleration_mL_s2, limits.step_rate_Hz, limits.pressure_kPa,
      limits.cavity_kPa);
}

void plan_settings(const RecordedRun& run, ReplayPlan& plan) {
  if (rig_number(run, "settings_record").value_or(0) == 0) return;
  for (const SettingWords& setting : setting_words()) {
    if (const auto recorded = rig_number(run, setting.name)) plan.settings[setting.name] = *recorded;
  }
}

void plan_start(const RunFile& file, ReplayPlan& plan) {
  const double microstep_mL = rig_number(file.run, "volume_per_step_mL").value_or(0.0078);
  const runfile::Series& commanded_mL = file.rows.pump.values.at("commanded_mL");
  if (commanded_mL.size() == 0 || std::isnan(commanded_mL.front())) return;
  const double start_mL = commanded_mL.front();
  if (std::abs(start_mL) > 0.5 * microstep_mL) plan.start_mL = start_mL;
}

}  // namespace

std::optional<double> rig_number(const RecordedRun& run, const std::string& name) {
  const auto found = run.rig.find(name);
  if (found == run.rig.end()) return std::nullopt;
  if (const auto* number = std::get_if<double>(&found->second)) return *number;
  if (const auto* integer = std::get_if<int64_t>(&found->second)) return static_cast<double>(*integer);
  return std::nullopt;
}

void plan_rig(const RunFile& file, const std::optional<MotionLimits>& limits, ReplayPlan& plan) {
  const RecordedRun& run = file.run;
  std::string rig = "format = \"diastole-rig\"\nversion = 1\n[rig]\n";
  for (const auto& [name, fallback] : needed) {
    const auto recorded = rig_number(run, name);
    if (!recorded) plan.remarks.push_back(fmt::format("/rig lacks {}: {:g} is assumed", name, fallback));
    rig += fmt::format("{} = {}\n", name, recorded.value_or(fallback));
  }
  rig += controller_table(run, limits ? *limits : limits_of(run, plan));
  rig +=
      "[daq]\ndriver = \"modbus-tcp\"\nhost = \"127.0.0.1\"\npreset = \"labjack-t\"\n" + channel_tables(run);
  const auto drift_ppm = [&](const char* name) {
    const auto found = run.clock.find(name);
    return found == run.clock.end() || std::abs(found->second) > 1000 ? 0 : found->second;
  };
  rig += fmt::format("[simulation]\ndaq_clock_error_ppm = {}\n", drift_ppm("daq_drift_ppm"));
  plan.rig_toml = rig;
  plan.host_drift_ppm = drift_ppm("host_drift_ppm");
  plan_settings(run, plan);
  plan_start(file, plan);
}

}  // namespace diastole::replay
