// What is asked of the daemon or ordered in one word: status, home, stop and the like.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/flash/elf_symbols.hpp"
#include "host/rpc/client.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds homing_timeout{3600};
constexpr int halts_asked = 20;  // until the halt's fault shows in the state
constexpr std::chrono::milliseconds halt_interval{50};

void show_journals(const json& journals) {
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

void show_status(const json& status) {
  const auto text = [&](const char* key) { return status.at(key).get<std::string>(); };
  const auto count = [&](const char* key) { return status.at(key).get<int64_t>(); };
  const auto known = [&](const char* key) { return status.contains(key) && !status.at(key).is_null(); };
  fmt::print("state     {}\n", text("state"));
  if (known("fault")) {
    fmt::print("fault     {} {}: {}\n          {}\n", count("fault_number"), text("fault"),
               text("fault_text"), text("remedy"));
  }
  if (known("notice")) fmt::print("notice    {}\n", text("notice"));
  fmt::print("position  {:.3f} mL{}\n", status.at("position_mL").get<double>(),
             text("state") != "unhomed" ? "" : ", counted from where it was switched on or lost its place");
  fmt::print(
      "counted   {} cycles of this run; {} triggers, {} R-waves, {} steps since the controller's reset\n",
      count("cycles"), count("triggers"), count("r_waves"), count("steps"));
  if (known("settings_problem")) fmt::print("settings  {}\n", text("settings_problem"));
  if (known("control")) {
    const json& control = status.at("control");
    fmt::print("control   {} ({})\n", control.at("user").get<std::string>(),
               control.contains("console") ? "console at " + control.at("console").get<std::string>()
                                           : fmt::format("process {}", control.at("pid").get<int64_t>()));
  }
  fmt::print("firmware  {} at {}\n", text("firmware"), text("controller"));
  if (status.at("takes_unsigned_firmware").get<bool>())
    fmt::print(
        "          NOT LOCKED: this controller has no key and takes firmware from anybody who reaches its "
        "serial line\n");
  fmt::print("pressure  {}\n", text("instrument"));
  const auto inputs = status.at("inputs").get<std::vector<std::string>>();
  fmt::print("inputs    {}; motor {}\n",
             inputs.empty() ? "none active" : fmt::format("{} active", fmt::join(inputs, ", ")),
             status.at("motor_powered").get<bool>() ? "powered" : "off");
  if (known("journals")) show_journals(status.at("journals"));
}

/// Adds to the program counter and the return address of each crash the function that they lie in.
void name_places(json& answer, const ElfSymbols& symbols) {
  for (json& entry : answer.at("entries")) {
    const std::string which = entry.value("register", "");
    if (which != "pc" && which != "lr") continue;
    const auto name = symbols.name_at(entry.at("value").get<uint32_t>());
    entry["symbol"] = name ? json(*name) : json();
    if (name) entry["text"] = fmt::format("{} in {}", entry.at("text").get<std::string>(), *name);
  }
}

void show_events(const json& answer) {
  int boot = 0;
  for (const auto& entry : answer.at("entries")) {
    if (const int its = entry.at("boot"); its != boot) {
      boot = its;
      fmt::print("start {} of the controller since power-on; seconds since then\n", boot);
    }
    fmt::print("{:14.6f}  {}\n", entry.at("time_s").get<double>(), entry.at("text").get<std::string>());
  }
  if (answer.at("since_power_on").get<bool>())
    fmt::print("This is all since power-on: what was before was lost with the power.\n");
}

void show_addresses(const json& console) {
  if (console.is_null()) {
    fmt::print("the daemon has no web console: start it with --console, or with `console` in [daemon]\n");
  } else {
    fmt::print("control   {}\nwatch     {}\n", console.at("control").get<std::string>(),
               console.at("watch").get<std::string>());
    if (console.contains("fingerprint"))
      fmt::print("certificate, SHA-256   {}\n", console.at("fingerprint").get<std::string>());
  }
}

bool continued(const json& answer) { return answer.at("continued"); }

void show_slice(const json& answer) {
  fmt::print("{}\n", continued(answer) ? fmt::format("slice {} begins with the next cycle",
                                                     answer.at("slice").get<int64_t>() + 1)
                                       : "nothing waits");
}

}  // namespace

void add_status(CommandLine& line) {
  add_question(line, {.command = "status",
                      .purpose = "the rig's state",
                      .examples = "  diastole status\n"
                                  "      state, fault in plain words with its remedy, position, firmware\n"
                                  "  diastole status --json --socket /run/diastole.sock",
                      .method = "rig.status",
                      .show = show_status});
}

void add_home(CommandLine& line) {
  add_question(
      line, {.command = "home",
             .purpose = "find the home switch; a pump that was switched on needs it before a run",
             .examples = "  diastole home\n"
                         "      withdraws slowly to the switch, calls that place 0 mL, and returns when done",
             .method = "rig.home",
             .show = show_status,
             .gives_order = true,
             .timeout = homing_timeout});
}

void add_clear_fault(CommandLine& line) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command =
      line.add("clear-fault", "leave a latched fault, once its cause is gone",
               "  diastole status\n"
               "      shows the fault's number, what happened and what to do about it\n"
               "  diastole clear-fault\n"
               "      homed again if the position is still known, else unhomed: diastole home is next");
  daemon->add_to(*command);
  daemon->add_take_over_to(*command);
  line.on_run(command, [daemon](const CommandOutput& out) {
    DaemonClient client = daemon->connect();
    json status = client.call("rig.status");
    const bool faulted = !status.at("fault").is_null();
    if (faulted) status = client.call("rig.clear_fault");
    if (!faulted && !out.json) fmt::print("fault     none is latched: nothing to clear\n");
    print(out, status, [&] { show_status(status); });
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
    const json status = client.call(
        "rig.jog", {{"mL", options->distance_mL}, {"rate_mL_s", options->rate_mL_s}}, homing_timeout);
    if (!out.json) {
      fmt::print("jogged    {:+.3f} mL{}\n", status.at("jogged_mL").get<double>(),
                 status.at("stopped").get<bool>() ? ", stopped on request" : "");
    }
    print(out, status, [&] { show_status(status); });
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
    json status = client.call("rig.status");
    for (int asked = 1; options->halt && stopping && status.at("fault").is_null() && asked < halts_asked;
         ++asked) {
      std::this_thread::sleep_for(halt_interval);
      status = client.call("rig.status");
    }
    status["stopping"] = stopping;
    print(out, status, [&] { show_status(status); });
    return ExitCode::done;
  });
}

void add_black_box(CommandLine& line) {
  struct BlackBoxOptions {
    DaemonAddress daemon;
    std::string elf;
  };
  auto options = std::make_shared<BlackBoxOptions>();
  CLI::App* command = line.add(
      "blackbox", "the controller's last events, kept over its resets",
      "  diastole blackbox\n"
      "      starts, states, faults, refusals, emergency stop, link: 160 of them, oldest first; and the\n"
      "      registers of a processor fault that ended the start before\n"
      "  diastole blackbox --elf build/firmware/bin/diastole-stm32f405.elf\n"
      "      the same, and in which function of that firmware the fault came\n"
      "  diastole blackbox --json > events.json");
  options->daemon.add_to(*command);
  command->add_option("--elf", options->elf, "the firmware's ELF file: names the places of processor faults");
  line.on_run(command, [options](const CommandOutput& out) {
    std::optional<ElfSymbols> symbols;
    if (!options->elf.empty()) symbols.emplace(options->elf);
    DaemonClient client(options->daemon.resolve());
    json answer = client.call("rig.black_box");
    if (symbols) name_places(answer, *symbols);
    print(out, answer, [&] { show_events(answer); });
    return ExitCode::done;
  });
}

void add_console(CommandLine& line) {
  add_question(
      line,
      {.command = "console",
       .purpose = "the addresses at which a browser finds the daemon's web console",
       .examples =
           "  diastole console\n"
           "      prints one address for control and one for watching and stopping; open one in a browser.\n"
           "      Each holds a token: give it to nobody who shall not do that\n"
           "Exit code 1: the daemon was started without --console.",
       .method = "console.address",
       .show = show_addresses,
       .positive = [](const json& console) { return !console.is_null(); }});
}

void add_continue(CommandLine& line) {
  add_question(line, {.command = "continue",
                      .purpose = "go on with the slice for which the run waits; anybody may",
                      .examples = "  diastole continue\n"
                                  "      the same as Enter in the terminal of `diastole run`\n"
                                  "Exit code 1: nothing waits.",
                      .method = "run.continue",
                      .show = show_slice,
                      .positive = continued});
}

}  // namespace diastole
