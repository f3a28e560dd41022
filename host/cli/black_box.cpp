#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "host/cli/daemon_address.hpp"
#include "host/cli/host_commands.hpp"
#include "host/rpc/client.hpp"

namespace diastole {
namespace {

void show(const nlohmann::json& told) {
  int boot = 0;
  for (const auto& entry : told.at("entries")) {
    if (const int its = entry.at("boot"); its != boot) {
      boot = its;
      fmt::print("start {} of the controller since power-on; seconds since then\n", boot);
    }
    fmt::print("{:14.6f}  {}\n", entry.at("time_s").get<double>(), entry.at("text").get<std::string>());
  }
  if (told.at("since_power_on").get<bool>())
    fmt::print("This is all since power-on: what was before was lost with the power.\n");
}

}  // namespace

void add_black_box(CommandLine& line) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command =
      line.add("blackbox", "the controller's last events, kept over its resets",
               "  diastole blackbox\n"
               "      starts, states, faults, refusals, emergency stop, link: 160 of them, oldest first\n"
               "  diastole blackbox --json > events.json");
  daemon->add_to(*command);
  line.on_run(command, [daemon](const CommandOutput& out) {
    DaemonClient client(daemon->resolve());
    const nlohmann::json told = client.call("rig.black_box");
    if (out.json)
      std::cout << told.dump(2) << '\n';
    else
      show(told);
    return ExitCode::done;
  });
}

}  // namespace diastole
