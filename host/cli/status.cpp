#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <thread>

#include "host/cli/daemon_address.hpp"
#include "host/cli/host_commands.hpp"
#include "host/rpc/client.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::chrono::seconds homing_patience{3600};
constexpr int halts_asked = 20;  // until the halt's fault shows in the state
constexpr std::chrono::milliseconds halt_interval{50};

void show_journals(const nlohmann::json& journals) {
  const auto days = journals.at("keep_days").get<int64_t>();
  fmt::print(
      "journals  {}, {:.1f} MB in {}; {}\n", journals.at("count").get<int64_t>(),
      1e-6 * journals.at("bytes").get<double>(), journals.at("directory").get<std::string>(),
      days == 0 ? "kept for ever" : fmt::format("kept for {} days after their run file was written", days));
  if (const auto open = journals.at("without_run_file").get<int64_t>(); open > 0) {
    fmt::print("          {} without a run file: diastole recover --list {}\n", open,
               journals.at("directory").get<std::string>());
  }
}

void show_status(const nlohmann::json& status, bool as_json) {
  if (as_json) {
    std::cout << status.dump(2) << '\n';
    return;
  }
  fmt::print("state     {}\n", status.at("state").get<std::string>());
  if (!status.at("fault").is_null()) {
    fmt::print("fault     {} {}: {}\n          {}\n", status.at("fault_number").get<int>(),
               status.at("fault").get<std::string>(), status.at("fault_text").get<std::string>(),
               status.at("remedy").get<std::string>());
  }
  if (const nlohmann::json notice = status.value("notice", nlohmann::json()); !notice.is_null())
    fmt::print("notice    {}\n", notice.get<std::string>());
  const bool known = status.at("state") != "unhomed";
  fmt::print("position  {:.3f} mL{}\n", status.at("position_mL").get<double>(),
             known ? "" : ", counted from where it was switched on or lost its place");
  fmt::print(
      "counted   {} cycles of this run; {} triggers, {} R-waves, {} steps since the controller's reset\n",
      status.at("cycles").get<int64_t>(), status.at("triggers").get<int64_t>(),
      status.at("r_waves").get<int64_t>(), status.at("steps").get<int64_t>());
  if (const nlohmann::json problem = status.value("settings_problem", nlohmann::json()); !problem.is_null())
    fmt::print("settings  {}\n", problem.get<std::string>());
  if (const nlohmann::json control = status.value("control", nlohmann::json()); !control.is_null()) {
    fmt::print("control   {} ({})\n", control.at("user").get<std::string>(),
               control.contains("console") ? "console at " + control.at("console").get<std::string>()
                                           : fmt::format("process {}", control.at("pid").get<int64_t>()));
  }
  fmt::print("firmware  {} at {}\n", status.at("firmware").get<std::string>(),
             status.at("controller").get<std::string>());
  fmt::print("pressure  {}\n", status.at("instrument").get<std::string>());
  std::string inputs;
  for (const nlohmann::json& input : status.at("inputs"))
    inputs += (inputs.empty() ? "" : ", ") + input.get<std::string>();
  fmt::print("inputs    {}; motor {}\n", inputs.empty() ? "none active" : inputs + " active",
             status.at("motor_powered").get<bool>() ? "powered" : "off");
  if (const nlohmann::json journals = status.value("journals", nlohmann::json()); !journals.is_null()) {
    show_journals(journals);
  }
}

/// A command that asks the daemon one question and shows the rig's state.
void add_question(CommandLine& line, const std::string& name, const std::string& purpose,
                  const std::string& examples, const std::string& method, std::chrono::seconds patience) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command = line.add(name, purpose, examples);
  daemon->add_to(*command);
  if (method != "rig.status") daemon->add_take_over_to(*command);
  line.on_run(command, [daemon, method, patience](const CommandOutput& out) {
    DaemonClient client = daemon->connect();
    show_status(client.call(method, nlohmann::json::object(), patience), out.json);
    return ExitCode::done;
  });
}

}  // namespace

void add_status(CommandLine& line) {
  add_question(line, "status", "the rig's state",
               "  diastole status\n"
               "      state, fault in plain words with its remedy, position, firmware\n"
               "  diastole status --json --socket /run/diastole.sock",
               "rig.status", std::chrono::seconds(30));
}

void add_home(CommandLine& line) {
  add_question(line, "home", "find the home switch; a pump that was switched on needs it before a run",
               "  diastole home\n"
               "      withdraws slowly to the switch, calls that place 0 mL, and returns when done",
               "rig.home", homing_patience);
}

void add_clear_fault(CommandLine& line) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command =
      line.add("clear-fault", "leave a latched fault, once its cause is gone",
               "  diastole status\n"
               "      tells the fault's number, what happened and what to do about it\n"
               "  diastole clear-fault\n"
               "      homed again if the position is still known, else unhomed: diastole home is next");
  daemon->add_to(*command);
  daemon->add_take_over_to(*command);
  line.on_run(command, [daemon](const CommandOutput& out) {
    DaemonClient client = daemon->connect();
    nlohmann::json status = client.call("rig.status");
    const bool faulted = !status.at("fault").is_null();
    if (faulted) status = client.call("rig.clear_fault");
    if (!faulted && !out.json) fmt::print("fault     none is latched: nothing to clear\n");
    show_status(status, out.json);
    return ExitCode::done;
  });
}

void add_jog(CommandLine& line) {
  struct JogOptions {
    DaemonAddress daemon;
    double distance_mL = 0;
    double rate_mL_s = 5;
  };
  auto options = std::make_shared<JogOptions>();
  CLI::App* command =
      line.add("jog", "move the piston by hand: so many mL from where it stands",
               "  diastole jog --mL 5 --rate-mL-s 10\n"
               "      inflates 5 mL from rest to rest; diastole stop ends it earlier\n"
               "  diastole jog --mL=-2\n"
               "      withdraws; unhomed too, at homing speed at most, to free a piston from a switch");
  command->add_option("--mL", options->distance_mL, "distance, inflate positive")->required();
  command->add_option("--rate-mL-s", options->rate_mL_s, "speed")->capture_default_str();
  options->daemon.add_to(*command);
  options->daemon.add_take_over_to(*command);
  line.on_run(command, [options](const CommandOutput& out) {
    if (!std::isfinite(options->distance_mL) || !std::isfinite(options->rate_mL_s)) {
      throw InputError({"", std::isfinite(options->distance_mL) ? "--rate-mL-s" : "--mL",
                        "is no finite number",
                        "Give a distance in mL and a speed in mL/s, for example --mL 5 --rate-mL-s 10."});
    }
    DaemonClient client = options->daemon.connect();
    const nlohmann::json status = client.call(
        "rig.jog", {{"mL", options->distance_mL}, {"rate_mL_s", options->rate_mL_s}}, homing_patience);
    if (!out.json) {
      fmt::print("jogged    {:+.3f} mL{}\n", status.at("jogged_mL").get<double>(),
                 status.at("stopped").get<bool>() ? ", stopped on request" : "");
    }
    show_status(status, out.json);
    return status.at("stopped").get<bool>() ? ExitCode::negative : ExitCode::done;
  });
}

void add_stop(CommandLine& line) {
  struct StopOptions {
    DaemonAddress daemon;
    bool cycle_end = false;
    bool halt = false;
  };
  auto options = std::make_shared<StopOptions>();
  CLI::App* command =
      line.add("stop", "stop the motion under control; anybody may",
               "  diastole stop\n"
               "      decelerates to rest now, a run, homing or a jog; the run keeps what was recorded\n"
               "  diastole stop --cycle-end\n"
               "  diastole stop --halt\n"
               "      cuts the pulses off at once: the position is lost, fault 6 is latched;\n"
               "      diastole clear-fault and diastole home afterwards");
  auto* cycle_end = command->add_flag("--cycle-end", options->cycle_end, "finish the present cycle first");
  command->add_flag("--halt", options->halt, "no deceleration: cut off at once")->excludes(cycle_end);
  options->daemon.add_to(*command);
  line.on_run(command, [options](const CommandOutput& out) {
    DaemonClient client(options->daemon.resolve());
    const char* how = options->halt ? "halt" : options->cycle_end ? "cycle_end" : "now";
    const bool stopping = client.call("run.stop", {{"how", how}}).at("stopping");
    if (!out.json) {
      fmt::print("{}\n", stopping ? "stop      asked for and accepted" : "stop      nothing was going on");
      std::fflush(stdout);
    }
    nlohmann::json status = client.call("rig.status");
    for (int asked = 1; options->halt && stopping && status.at("fault").is_null() && asked < halts_asked;
         ++asked) {
      std::this_thread::sleep_for(halt_interval);
      status = client.call("rig.status");
    }
    status["stopping"] = stopping;
    show_status(status, out.json);
    return ExitCode::done;
  });
}

}  // namespace diastole
