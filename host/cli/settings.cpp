#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/controller/settings_values.hpp"
#include "host/rpc/client.hpp"

namespace diastole {
namespace {

using nlohmann::json;

struct SettingsOptions {
  DaemonAddress daemon;
  std::vector<std::string> set;
  std::vector<double> calibrate_mL;
  bool defaults = false;
};

/// "name=value"; what is no number is a text.
json parse_changes(const std::vector<std::string>& words) {
  json changes = json::object();
  for (const std::string& word : words) {
    const size_t sign = word.find('=');
    if (sign == std::string::npos || sign == 0) {
      throw InputError({"", "--set " + word, "is not NAME=VALUE", "For example --set backlash_um=40"});
    }
    const std::string value = word.substr(sign + 1);
    const json number = json::parse(value, nullptr, false);
    changes[word.substr(0, sign)] = number.is_number() ? number : json(value);
  }
  return changes;
}

/// What was displaced against what was commanded, on top of the calibration in force.
json calibration(const json& in_force, const std::vector<double>& pair_mL) {
  const double commanded_mL = pair_mL.at(0), measured_mL = pair_mL.at(1);
  if (!(commanded_mL > 0) || !(measured_mL > 0)) {
    throw InputError({"", "--calibrate",
                      fmt::format("{:g} and {:g} are not two volumes", commanded_mL, measured_mL),
                      "Give the commanded and the measured volume between two points, both positive."});
  }
  const double before = 1 + 1e-6 * in_force.at("settings").at("calibration_ppm").get<double>();
  return std::round(1e6 * (before * measured_mL / commanded_mL - 1));
}

void show(const json& report) {
  const json& settings = report.at("settings");
  for (const SettingWords& words : setting_words())
    fmt::print("{:<18} {:<10}  {}\n", words.name, settings.at(words.name).dump(), words.explanation);
  fmt::print("{:<18} {:<10}  {}\n", "board_name", settings.at("board_name").get<std::string>(),
             "for people; goes into every run file");
  fmt::print("one microstep is {:.6f} uL; the backlash {} microsteps\n",
             report.at("microstep_uL").get<double>(), report.at("backlash_microsteps").get<int>());
  const int record = report.at("record");
  if (record == 0)
    fmt::print(
        "none were ever written to this controller: these are the initial ones, and the rig file alone "
        "counts\n");
  else
    fmt::print("record {} in the controller's flash\n", record);
  if (!report.at("problem").is_null()) fmt::print("\n{}\n", report.at("problem").get<std::string>());
}

ExitCode run(const SettingsOptions& options, const CommandOutput& out) {
  DaemonClient client = options.daemon.connect();
  json changes = parse_changes(options.set);
  json report = client.call("rig.settings");
  if (!options.calibrate_mL.empty()) changes["calibration_ppm"] = calibration(report, options.calibrate_mL);
  if (options.defaults || !changes.empty())
    report = client.call("rig.write_settings", {{"set", changes}, {"defaults", options.defaults}});
  print(out, report, [&] { show(report); });
  return report.at("problem").is_null() ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_settings(CommandLine& line) {
  auto options = std::make_shared<SettingsOptions>();
  CLI::App* command = line.add(
      "settings", "what belongs to the pump, kept in the controller's flash",
      "  diastole settings\n"
      "      all of them with their meaning, and whether the rig file agrees\n"
      "  diastole settings --set microsteps=8 --set backlash_um=40 --set board_name=MR1\n"
      "      checked, written all at once, in force at once; the pump has to be homed again\n"
      "  diastole settings --calibrate 50 49.62\n"
      "      50 mL were commanded between two points and 49.62 mL measured: corrects calibration_ppm\n"
      "  diastole settings --defaults\n"
      "Exit code 1: the rig file disagrees with them, and nothing moves until they agree.");
  command->add_option("--set", options->set, "NAME=VALUE; may be repeated")->allow_extra_args(false);
  command->add_option("--calibrate", options->calibrate_mL, "commanded and measured volume, in mL")
      ->expected(2);
  command->add_flag("--defaults", options->defaults, "begin with the initial ones (before --set)");
  options->daemon.add_to(*command);
  options->daemon.add_take_over_to(*command);
  line.on_run(command, [options](const CommandOutput& out) { return run(*options, out); });
}

}  // namespace diastole
