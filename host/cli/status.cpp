#include <fmt/format.h>

#include <cstdio>
#include <iostream>
#include <memory>

#include "host/cli/daemon_address.hpp"
#include "host/cli/host_commands.hpp"
#include "host/daemon/client.hpp"

namespace diastole {
namespace {

constexpr std::chrono::seconds homing_patience{3600};

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
    fmt::print("fault     {}: {}\n          {}\n", status.at("fault").get<std::string>(),
               status.at("fault_text").get<std::string>(), status.at("remedy").get<std::string>());
  }
  fmt::print("position  {:.3f} mL\n", status.at("position_mL").get<double>());
  if (const nlohmann::json control = status.value("control", nlohmann::json()); !control.is_null()) {
    fmt::print("control   {} (process {})\n", control.at("user").get<std::string>(),
               control.at("pid").get<int64_t>());
  }
  fmt::print("firmware  {} at {}\n", status.at("firmware").get<std::string>(),
             status.at("controller").get<std::string>());
  fmt::print("pressure  {}\n", status.at("instrument").get<std::string>());
  std::string inputs;
  for (const nlohmann::json& input : status.at("inputs"))
    inputs += (inputs.empty() ? "" : ", ") + input.get<std::string>();
  fmt::print("inputs    {}; motor {}; {} triggers since reset\n",
             inputs.empty() ? "none active" : inputs + " active",
             status.at("motor_powered").get<bool>() ? "powered" : "off",
             status.at("triggers").get<uint32_t>());
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

void add_stop(CommandLine& line) {
  struct StopOptions {
    DaemonAddress daemon;
    bool cycle_end = false;
  };
  auto options = std::make_shared<StopOptions>();
  CLI::App* command = line.add("stop", "stop the motion under control; anybody may",
                               "  diastole stop\n"
                               "      decelerates to rest now; the run keeps what was recorded\n"
                               "  diastole stop --cycle-end");
  command->add_flag("--cycle-end", options->cycle_end, "finish the present cycle first");
  options->daemon.add_to(*command);
  line.on_run(command, [options](const CommandOutput& out) {
    DaemonClient client(options->daemon.resolve());
    const bool stopping =
        client.call("run.stop", {{"how", options->cycle_end ? "cycle_end" : "now"}}).at("stopping");
    if (!out.json) {
      fmt::print("{}\n", stopping ? "stop      asked for and accepted" : "stop      nothing was going on");
      std::fflush(stdout);
    }
    nlohmann::json status = client.call("rig.status");
    status["stopping"] = stopping;
    show_status(status, out.json);
    return ExitCode::done;
  });
}

}  // namespace diastole
