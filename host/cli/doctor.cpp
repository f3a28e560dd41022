#include <fmt/format.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <optional>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/doctor/machine_checks.hpp"
#include "host/doctor/udev_rules.hpp"
#include "protocol/contract/named_members.hpp"

namespace diastole {
namespace {

volatile std::sig_atomic_t measuring_ended = 0;

struct DoctorOptions {
  std::filesystem::path config;
  double latency_s = 5;
  bool udev_rules = false;
};

const char* state_word(MachineCheck::State state) {
  switch (state) {
    case MachineCheck::State::good:
      return "good";
    case MachineCheck::State::lacking:
      return "lacking";
    case MachineCheck::State::not_used:
      return "not used";
  }
  return "";
}

void show(const MachineCheck& check) {
  fmt::print("{:9} {:12} {}\n", state_word(check.state), check.name, check.found);
  if (!check.remedy.empty()) fmt::print("{:22} -> {}\n", "", check.remedy);
  std::fflush(stdout);
}

/// For the devices that the rig file names and that are there.
ExitCode print_udev_rules(const RigConfig& rig, const CommandOutput& out) {
  const std::vector<std::string> rules = udev_rules(rig);
  print(out, {{"udev_rules", rules}}, [&] {
    fmt::print("# The devices of {}, for nobody but the daemon (docs/daemon.md).\n", rig.file);
    for (const std::string& rule : rules)
      fmt::print("{}\n", rule);
  });
  return ExitCode::done;
}

ExitCode doctor(const DoctorOptions& options, const CommandOutput& out) {
  std::optional<RigConfig> rig;
  if (!options.config.empty()) rig = read_rig(options.config);
  if (options.udev_rules) return print_udev_rules(*rig, out);
  std::vector<MachineCheck> checks = check_machine(rig);
  if (!out.json)
    for (const MachineCheck& check : checks)
      show(check);
  if (options.latency_s > 2)
    fmt::print(stderr, "measuring for {:g} s how late a thread wakes\n", options.latency_s);
  std::signal(SIGINT, [](int) { measuring_ended = 1; });
  const Latency latency = measure_latency(options.latency_s, [] { return measuring_ended == 0; });
  std::signal(SIGINT, SIG_DFL);
  checks.push_back(check_latency(latency));
  if (!out.json) show(checks.back());
  bool ready = true;
  nlohmann::json list = nlohmann::json::array();
  for (const MachineCheck& check : checks) {
    ready = ready && check.state != MachineCheck::State::lacking;
    list.push_back({DIASTOLE_NAMED(check, name, found, remedy), {"state", state_word(check.state)}});
  }
  print(out,
        {{"checks", list},
         {"latency", {DIASTOLE_NAMED(latency, seconds, wakes, median_us, p999_us, worst_us, priority)}},
         {"config", options.config.empty() ? nlohmann::json() : nlohmann::json(options.config.string())},
         {"ready", ready}},
        [&] {
          fmt::print("{}\n", ready
                                 ? "This machine can run a rig."
                                 : "A real rig needs what lacks; simulations, fits and explanations do not.");
        });
  return ready ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_doctor(CommandLine& line) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = line.add(
      "doctor", "what this machine lacks for a real rig, and what to do about it",
      "  diastole doctor\n"
      "      serial port, groups, udev rules, GPIO, instrument, time, priority, disk, and how late the\n"
      "      kernel wakes a thread, measured for 5 s\n"
      "  diastole doctor --config rig.toml\n"
      "      the port, the lines, the instrument and the folder that the rig file names; nothing moves\n"
      "  diastole doctor --config rig.toml --udev-rules | sudo tee /etc/udev/rules.d/61-diastole-rig.rules\n"
      "      a rule that gives that controller and those lines to the daemon's group, and no others\n"
      "Exit code 1: something lacks. Simulations, fits and explanations need none of it.");
  auto* config = command->add_option("--config", options->config, "rig file (.toml)");
  command
      ->add_flag("--udev-rules", options->udev_rules,
                 "print udev rules for the rig file's devices, and no more")
      ->needs(config);
  command->add_option("--latency-s", options->latency_s, "how long to measure")
      ->check(number_between(0.1, 600.0))
      ->capture_default_str();
  line.on_run(command, [options](const CommandOutput& out) { return doctor(*options, out); });
}

}  // namespace diastole
