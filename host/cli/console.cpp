#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"

namespace diastole {
namespace {

void show_addresses(const nlohmann::json& console) {
  if (console.is_null()) {
    fmt::print("the daemon has no web console: start it with --console, or with `console` in [daemon]\n");
  } else {
    fmt::print("control   {}\nwatch     {}\n", console.at("control").get<std::string>(),
               console.at("watch").get<std::string>());
  }
}

}  // namespace

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
       .positive = [](const nlohmann::json& console) { return !console.is_null(); }});
}

}  // namespace diastole
