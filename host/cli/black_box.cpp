#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"

namespace diastole {
namespace {

void show_events(const nlohmann::json& answer) {
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

}  // namespace

void add_black_box(CommandLine& line) {
  add_question(line,
               {.command = "blackbox",
                .purpose = "the controller's last events, kept over its resets",
                .examples = "  diastole blackbox\n"
                            "      starts, states, faults, refusals, emergency stop, link: 160 of them, "
                            "oldest first\n"
                            "  diastole blackbox --json > events.json",
                .method = "rig.black_box",
                .show = show_events});
}

}  // namespace diastole
