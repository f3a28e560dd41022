#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>

#include "host/cli/daemon_address.hpp"
#include "host/cli/host_commands.hpp"
#include "host/cli/session_view.hpp"
#include "host/daemon/run_session.hpp"

namespace diastole {
namespace {

volatile std::sig_atomic_t interrupts = 0;

struct RunOptions {
  SessionOptions session;
  DaemonAddress daemon;
};

ExitCode run(RunOptions options, const CommandOutput& out) {
  DaemonClient daemon = options.daemon.connect();
  SessionView view(isatty(STDERR_FILENO) != 0);
  interrupts = 0;
  std::signal(SIGINT, [](int) { interrupts = interrupts + 1; });
  options.session.stops_asked = [] { return static_cast<int>(interrupts); };
  options.session.progress = [&view](const SessionProgress& progress) { view.show(progress); };
  const SessionResult result = run_session(daemon, options.session);
  std::signal(SIGINT, SIG_DFL);
  view.finish();
  return report_session(result, out.json);
}

}  // namespace

void add_run(CommandLine& line) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      line.add("run", "acquire a session through the daemon",
               "  diastole run gel.experiment.toml -o gel.run.h5\n"
               "      shows progress, trigger count and faults; Ctrl-C once stops at the end of the\n"
               "      cycle, twice at once under control; what was recorded is kept either way\n"
               "  diastole run gel.experiment.toml -o gel.run.h5 --json > gel.json\n"
               "Exit code 1: samples are missing; 3: a fault or a broken link ended the run.");
  command->add_option("EXPERIMENT", options->session.experiment, "experiment file (.toml)")->required();
  command->add_option("-o,--output", options->session.output, "run file to write")->required();
  command->add_flag("--force", options->session.force, "replace the run file if it exists");
  options->daemon.add_to(*command);
  options->daemon.add_take_over_to(*command);
  line.on_run(command, [options](const CommandOutput& out) { return run(*options, out); });
}

}  // namespace diastole
