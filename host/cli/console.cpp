#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "host/cli/daemon_address.hpp"
#include "host/cli/host_commands.hpp"
#include "host/rpc/client.hpp"

namespace diastole {

void add_console(CommandLine& line) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command = line.add(
      "console", "the addresses at which a browser finds the daemon's web console",
      "  diastole console\n"
      "      prints one address for control and one for watching and stopping; open one in a browser.\n"
      "      Each holds a token: give it to nobody who shall not do that\n"
      "Exit code 1: the daemon was started without --console.");
  daemon->add_to(*command);
  line.on_run(command, [daemon](const CommandOutput& out) {
    DaemonClient client(daemon->resolve());
    const nlohmann::json console = client.call("console.address");
    if (out.json) {
      std::cout << console.dump(2) << '\n';
    } else if (console.is_null()) {
      fmt::print("the daemon has no web console: start it with --console, or with `console` in [daemon]\n");
    } else {
      fmt::print("control   {}\nwatch     {}\n", console.at("control").get<std::string>(),
                 console.at("watch").get<std::string>());
    }
    return console.is_null() ? ExitCode::negative : ExitCode::done;
  });
}

}  // namespace diastole
