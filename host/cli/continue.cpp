#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"

namespace diastole {
namespace {

bool continued(const nlohmann::json& answer) { return answer.at("continued"); }

void show_slice(const nlohmann::json& answer) {
  fmt::print("{}\n", continued(answer) ? fmt::format("slice {} begins with the next cycle",
                                                     answer.at("slice").get<int64_t>() + 1)
                                       : "nothing waits");
}

}  // namespace

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
