#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/rpc/client.hpp"

namespace diastole {
namespace {

using nlohmann::json;

void show_checks(const json& answer) {
  for (const json& check : answer.at("checks")) {
    const bool passed = check.at("passed");
    const std::string measured = check.at("measured").is_null()
                                     ? "nothing"
                                     : fmt::format("{:.4g}", check.at("measured").get<double>());
    fmt::print("{}  {:<32} {:>9} {:<8} limits {:.4g} to {:.4g}\n", passed ? "ok  " : "FAIL",
               check.at("what").get<std::string>(), measured, check.at("unit").get<std::string>(),
               check.at("least").get<double>(), check.at("most").get<double>());
    if (!passed) fmt::print("      {}\n", check.at("remedy").get<std::string>());
  }
  fmt::print("{}\n", answer.at("passed").get<bool>() ? "the board is as it should be"
                                                     : "the board, or a wire, is not as it should be");
}

}  // namespace

void add_self_test(CommandLine& line) {
  struct SelfTestOptions {
    DaemonAddress daemon;
    double seconds = 10;
  };
  auto options = std::make_shared<SelfTestOptions>();
  CLI::App* command =
      line.add("selftest", "have the controller measure its own outputs over three loop-back wires",
               "  diastole selftest\n"
               "      wires PA6 to PA3, PA1 to PA5 and PA4 to PC3 (docs/on-the-chip.md); nothing else on "
               "these pins: motor\n"
               "      driver and scanner unplugged. TTLs and their time, STEP and R-wave beside them, steps "
               "counted, the\n"
               "      R-wave's levels, the supply, and the clock against this machine's: a line each\n"
               "  diastole selftest --seconds 60 --json\n"
               "      the clock to a few ppm\n"
               "Refused while the pump moves, and while its motor is powered: reset the controller first. "
               "Exit code 1: a\n"
               "check failed; what to do stands below it.");
  command->add_option("--seconds", options->seconds, "how long the clocks are compared")
      ->capture_default_str()
      ->check(number_between(2.0, 600.0));
  options->daemon.add_to(*command);
  options->daemon.add_take_over_to(*command);
  line.on_run(command, [options](const CommandOutput& out) {
    DaemonClient client = options->daemon.connect();
    if (isatty(STDERR_FILENO) != 0)
      fmt::print(stderr, "measuring; the clocks are compared for {:g} s ...\n", options->seconds);
    const auto timeout = std::chrono::seconds(static_cast<int>(options->seconds) + 30);
    const json answer = client.call("rig.self_test", {{"seconds", options->seconds}}, timeout);
    print(out, answer, [&] { show_checks(answer); });
    return answer.at("passed").get<bool>() ? ExitCode::done : ExitCode::negative;
  });
}

}  // namespace diastole
