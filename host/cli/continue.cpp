#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "host/cli/daemon_address.hpp"
#include "host/cli/host_commands.hpp"
#include "host/rpc/client.hpp"

namespace diastole {

void add_continue(CommandLine& line) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command = line.add("continue", "go on with the slice for which the run waits; anybody may",
                               "  diastole continue\n"
                               "      the same as Enter in the terminal of `diastole run`\n"
                               "Exit code 1: nothing waits.");
  daemon->add_to(*command);
  line.on_run(command, [daemon](const CommandOutput& out) {
    DaemonClient client(daemon->resolve());
    const nlohmann::json answer = client.call("run.continue");
    const bool continued = answer.at("continued");
    if (out.json) {
      std::cout << answer.dump(2) << '\n';
    } else {
      fmt::print("{}\n", continued ? fmt::format("slice {} begins with the next cycle",
                                                 answer.at("slice").get<int64_t>() + 1)
                                   : "nothing waits");
    }
    return continued ? ExitCode::done : ExitCode::negative;
  });
}

}  // namespace diastole
