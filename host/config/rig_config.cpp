#include "host/config/rig_config.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

namespace diastole {
namespace {

constexpr std::array optional_numbers{
    "hose_wave_speed_m_s", "hose_creep_fraction",   "hose_creep_time_s",         "hose_minor_loss_K",
    "hose_loss_at_cavity", "fluid_viscosity_Pa_s",  "catheter_length_m",         "catheter_f0_Hz",
    "catheter_zeta",       "atmospheric_kPa",       "specimen_temperature_degC", "cavity_range_kPa",
    "pump_range_kPa",      "cavity_resolution_kPa", "pump_resolution_kPa"};
constexpr std::array optional_texts{"name", "site", "operator", "specimen"};

double disc_area_m2(double diameter_mm) { return std::numbers::pi / 4 * diameter_mm * diameter_mm * 1e-6; }

/// White, Fluid Mechanics, 6.4 and 6.6, for a smooth pipe.
HoseLosses losses_of(double length_m, double bore_mm, double density_kg_m3, double viscosity_Pa_s,
                     double minor_loss_K) {
  constexpr double flow_m3_s = 1e-3;
  const double bore_m = 1e-3 * bore_mm;
  const double speed_m_s = flow_m3_s / disc_area_m2(bore_mm);
  const double dynamic_Pa = density_kg_m3 * speed_m_s * speed_m_s / 2;
  const double reynolds = density_kg_m3 * speed_m_s * bore_m / viscosity_Pa_s;
  const double lengths = length_m / bore_m;
  return {64 / reynolds * lengths * dynamic_Pa, 0.3164 / std::pow(reynolds, 0.25) * lengths * dynamic_Pa,
          minor_loss_K * dynamic_Pa};
}

/// The controller counts microsteps with a sign in 32 bits, their volume in whole picolitres, and the hose's
/// inertance in whole kg/m4; what does not fit would switch a limit off.
void check_geometry(const TableReader& rig, const RigConfig& config) {
  constexpr double least_microstep_pL = 1000;  // so that whole picolitres are exact to 0.05 %
  constexpr double most_microstep_pL = 4e9;
  constexpr double most_inertance_kg_m4 = UINT32_MAX;
  const double microstep_pL = 1e9 * config.microstep_mL;
  if (microstep_pL < least_microstep_pL || microstep_pL > most_microstep_pL) {
    rig.fail("bore_mm",
             fmt::format(
                 "gives with screw, steps and microsteps {:g} pL a microstep; {:g} to {:g} pL are possible",
                 microstep_pL, least_microstep_pL, most_microstep_pL),
             "Correct bore_mm, screw_rev_per_cm, steps_per_rev or microsteps.");
  }
  const double inertance_kg_m4 = config.hose_inertance_kg_m4;
  if (inertance_kg_m4 < 1 || inertance_kg_m4 > most_inertance_kg_m4) {
    rig.fail(
        "hose_bore_mm",
        fmt::format("gives with length and density an inertance of {:g} kg/m4; 1 to {:g} kg/m4 are possible",
                    inertance_kg_m4, most_inertance_kg_m4),
        "Correct hose_bore_mm, hose_length_m or fluid_density_kg_m3.");
  }
  const double travel_microsteps = config.controller.limits.travel_mL / config.microstep_mL;
  if (travel_microsteps > INT32_MAX) {
    rig.fail("bore_mm",
             fmt::format("makes travel_mL = {:g} in [controller.limits] {:g} microsteps; {} can be counted",
                         config.controller.limits.travel_mL, travel_microsteps, INT32_MAX),
             "Lower travel_mL to what the pump has, or use fewer microsteps.");
  }
}

void read_geometry(TableReader rig, RigConfig& config) {
  auto& attributes = config.attributes;
  const double bore_mm = rig.number("bore_mm", {.at_least = 1, .at_most = 1000});
  const double screw_rev_per_cm = rig.number("screw_rev_per_cm", {.at_least = 0.01, .at_most = 1000});
  const int64_t steps_per_rev = rig.integer("steps_per_rev", {.at_least = 1, .at_most = 100'000});
  const double hose_length_m = rig.number("hose_length_m", {.at_least = 0.001, .at_most = 1000});
  const double hose_bore_mm = rig.number("hose_bore_mm", {.at_least = 0.1, .at_most = 1000});
  const double density_kg_m3 = rig.number("fluid_density_kg_m3", {.at_least = 1, .at_most = 30'000});
  attributes = {{"bore_mm", bore_mm},
                {"screw_rev_per_cm", screw_rev_per_cm},
                {"steps_per_rev", steps_per_rev},
                {"microsteps", config.controller.microsteps},
                {"hose_length_m", hose_length_m},
                {"hose_bore_mm", hose_bore_mm},
                {"fluid_density_kg_m3", density_kg_m3}};
  for (const char* key : optional_numbers) {
    if (rig.has(key)) attributes[key] = rig.number(key);
  }
  if (constexpr const char* lag = "drive_lag_s"; rig.has(lag))
    attributes[lag] = rig.number(lag, {.at_least = 0, .at_most = 1});
  for (const char* key : optional_texts) {
    if (rig.has(key)) attributes[key] = rig.text(key);
  }
  if (auto tolerance = rig.table_if("tolerance")) {
    for (const auto& [part, sd] : tolerance->named_numbers({.above = 0}))
      attributes["tolerance_" + part] = sd;
    tolerance->finish();
  }
  rig.finish();
  const double microsteps_per_m = 100 * screw_rev_per_cm * static_cast<double>(steps_per_rev) *
                                  static_cast<double>(config.controller.microsteps);
  config.microstep_mL = 1e6 * disc_area_m2(bore_mm) / microsteps_per_m;
  config.hose_inertance_kg_m4 = density_kg_m3 * hose_length_m / disc_area_m2(hose_bore_mm);
  // Water at 20 °C, and a hose that opens sharply at both ends (0.5 + 1), unless the file says otherwise.
  const auto given_or = [&](const char* key, double usual) {
    const auto found = attributes.find(key);
    return found == attributes.end() ? usual : std::get<double>(found->second);
  };
  config.hose_losses = losses_of(hose_length_m, hose_bore_mm, density_kg_m3,
                                 given_or("fluid_viscosity_Pa_s", 0.001), given_or("hose_minor_loss_K", 1.5));
  attributes["volume_per_step_mL"] = config.microstep_mL;
  check_geometry(rig, config);
}

MotionLimits read_limits(TableReader table) {
  MotionLimits limits;
  limits.travel_mL = table.number_or("travel_mL", limits.travel_mL, {.above = 0, .at_most = 50'000});
  limits.flow_mL_s = table.number_or("flow_mL_s", limits.flow_mL_s, {.above = 0, .at_most = 10'000});
  limits.acceleration_mL_s2 =
      table.number_or("acceleration_mL_s2", limits.acceleration_mL_s2, {.above = 0, .at_most = 1e6});
  limits.step_rate_Hz =
      table.number_or("step_rate_Hz", limits.step_rate_Hz, {.at_least = 1, .at_most = 400'000});
  limits.pressure_kPa = table.number_or("pressure_kPa", limits.pressure_kPa, {.above = 0, .at_most = 10'000});
  limits.cavity_kPa = table.number_or("cavity_kPa", limits.cavity_kPa, {.at_least = 0, .at_most = 10'000});
  limits.homing_flow_mL_s =
      table.number_or("homing_flow_mL_s", limits.homing_flow_mL_s, {.above = 0, .at_most = 10'000});
  table.finish();
  return limits;
}

ControllerConfig read_controller(TableReader table) {
  ControllerConfig controller;
  controller.port = table.text("port");
  controller.baud = static_cast<unsigned>(table.integer_or("baud", controller.baud, {.at_least = 9600}));
  controller.microsteps =
      table.integer_or("microsteps", controller.microsteps, {.at_least = 1, .at_most = 256});
  controller.lease_ms = table.integer_or("lease_ms", controller.lease_ms, {.at_least = 100, .at_most = 5000});
  controller.ttl_width_ms =
      table.number_or("ttl_width_ms", controller.ttl_width_ms, {.at_least = 0.01, .at_most = 1000});
  if (auto limits = table.table_if("limits")) controller.limits = read_limits(std::move(*limits));
  table.finish();
  return controller;
}

/// A channel's name becomes a dataset's, NAME_kPa, beside those that the daemon makes itself.
std::string channel_name(TableReader& channel) {
  constexpr std::string_view made_by_us = "_filtered";
  std::string name = channel.text("name");
  const auto lower = [](char c) { return c >= 'a' && c <= 'z'; };
  const bool spelled = !name.empty() && lower(name.front()) && std::ranges::all_of(name, [&](char c) {
    return lower(c) || (c >= '0' && c <= '9') || c == '_';
  });
  if (!spelled) {
    channel.fail("name", fmt::format("\"{}\" cannot name a dataset of the run file", name),
                 "Begin with a small letter and go on with small letters, digits and _: \"pump_end\".");
  }
  if (name.ends_with(made_by_us)) {
    channel.fail(
        "name", fmt::format("\"{}\" would be taken for a filtered signal", name),
        "Choose a name that does not end with _filtered: such datasets are made from other channels.");
  }
  return name;
}

DaqConfig read_daq(TableReader table) {
  DaqConfig config;
  std::vector<std::string> names;
  for (const daq::Driver* driver : daq::drivers())
    names.emplace_back(driver->name);
  config.driver = table.choice("driver", names);
  std::vector<TableReader> channels = table.tables("channel");
  if (channels.empty()) table.fail("channel", "is missing", "Add [[daq.channel]] with name = \"cavity\".");
  for (TableReader& channel : channels) {
    const ChannelConfig read{channel_name(channel), channel.number("kPa_per_V"),
                             channel.number_or("zero_V", 0)};
    if (read.kPa_per_V == 0) channel.fail("kPa_per_V", "is 0", "Give the transducer's; below 0 if inverted.");
    const bool named_twice = std::any_of(config.channels.begin(), config.channels.end(),
                                         [&](const ChannelConfig& each) { return each.name == read.name; });
    if (named_twice) channel.fail("name", fmt::format("\"{}\" is given twice", read.name), "Rename one.");
    config.channels.push_back(read);
  }
  if (std::none_of(config.channels.begin(), config.channels.end(),
                   [](const ChannelConfig& each) { return each.name == "cavity"; })) {
    table.fail("channel", "has no channel named \"cavity\"",
               "A run file always holds the cavity's pressure.");
  }
  const auto driver = std::find(names.begin(), names.end(), config.driver) - names.begin();
  config.open = daq::drivers()[static_cast<size_t>(driver)]->configure(table, channels);
  for (TableReader& channel : channels)
    channel.finish();
  table.finish();
  return config;
}

GpioConfig read_gpio(TableReader table) {
  GpioConfig gpio{.chip = table.text("chip")};
  const auto line = [&table](const char* key) -> std::optional<unsigned> {
    if (!table.has(key)) return std::nullopt;
    return static_cast<unsigned>(table.integer(key, {.at_least = 0, .at_most = 1023}));
  };
  gpio.gate_line = line("gate_line");
  gpio.estop_line = line("estop_line");
  gpio.gate_active_low = table.flag_or("gate_active_low", false);
  gpio.estop_active_low = table.flag_or("estop_active_low", false);
  if (!gpio.gate_line && !gpio.estop_line) {
    table.fail("gate_line", "is missing, and estop_line too", "Give one of them, or remove [gpio].");
  }
  table.finish();
  return gpio;
}

DaemonConfig read_daemon(std::optional<TableReader> table) {
  DaemonConfig daemon{
      .socket = default_socket(), .journal_dir = "journals", .console = {}, .control_group = ""};
  if (!table) return daemon;
  daemon.socket = table->text_or("socket", daemon.socket);
  daemon.journal_dir = table->text_or("journal_dir", daemon.journal_dir.string());
  daemon.keep_days = table->integer_or("keep_days", daemon.keep_days, {.at_least = 0, .at_most = 36'500});
  if (table->has("console")) daemon.console = table->text("console");
  daemon.control_group = table->text_or("control_group", daemon.control_group);
  table->finish();
  return daemon;
}

}  // namespace

std::string default_socket() {
  const auto environment = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value != nullptr ? value : "");
  };
  std::error_code ignored;
  if (const std::string runtime = environment("XDG_RUNTIME_DIR"); !runtime.empty())
    return runtime + "/diastole.sock";
  if (::geteuid() == 0) return "/run/diastole.sock";
  const std::string runtime = fmt::format("/run/user/{}", ::geteuid());
  if (std::filesystem::is_directory(runtime, ignored)) return runtime + "/diastole.sock";
  const std::string state = environment("XDG_STATE_HOME");
  return (state.empty() ? environment("HOME") + "/.local/state" : state) + "/diastole/daemon.sock";
}

void make_default_socket_folder() {
  const std::filesystem::path folder = std::filesystem::path(default_socket()).parent_path();
  std::error_code failed;  // then the socket cannot be made, which is reported
  if (std::filesystem::create_directories(folder, failed))
    std::filesystem::permissions(folder, std::filesystem::perms::owner_all, failed);
}

RigConfig read_rig(const std::filesystem::path& path) { return read_rig(TableReader::from_file(path)); }

RigConfig read_rig(TableReader root) {
  root.expect_format("diastole-rig", 1);
  RigConfig config;
  config.file = root.file();
  config.controller = read_controller(root.table("controller"));
  read_geometry(root.table("rig"), config);
  config.daq = read_daq(root.table("daq"));
  if (auto gpio = root.table_if("gpio")) config.gpio = read_gpio(std::move(*gpio));
  config.daemon = read_daemon(root.table_if("daemon"));
  (void)root.has("simulation");  // concerns the simulated rig only, which checks it
  root.finish();
  return config;
}

}  // namespace diastole
