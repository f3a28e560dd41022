#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/cli/session_facts.hpp"
#include "host/cli/session_series.hpp"
#include "host/cli/session_view.hpp"
#include "host/config/experiment.hpp"
#include "host/rpc/run_session.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

volatile std::sig_atomic_t interrupts = 0;

struct RunOptions {
  SessionOptions session;
  DaemonAddress daemon;
  bool dry_run = false;
  bool asks = true;
};

/// How many lines were entered since the last question; never waits.
int lines_entered() {
  int entered = 0;
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 0) == 1 && (input.revents & POLLIN) != 0;) {
    std::array<char, 256> text{};
    const ssize_t count = ::read(STDIN_FILENO, text.data(), text.size());
    if (count <= 0) break;
    entered += static_cast<int>(std::count(text.begin(), text.begin() + count, '\n'));
  }
  return entered;
}

ExitCode show_plan(const Experiment& experiment, const CommandOutput& out) {
  print(out, plan_json(experiment), [&] { fmt::print("{}", plan_words(experiment)); });
  return ExitCode::done;
}

/// One session, shown as it goes.
SessionResult acquire(DaemonClient& daemon, SessionOptions session) {
  if (!session.resume) fmt::print(stderr, "{}", plan_words(read_experiment(session.experiment)));
  SessionView view(isatty(STDERR_FILENO) != 0);
  if (isatty(STDIN_FILENO) != 0) {
    session.ready = [&view] {
      const int lines = lines_entered();
      view.entered(lines);
      return lines > 0;
    };
  }
  interrupts = 0;
  std::signal(SIGINT, [](int) { interrupts = interrupts + 1; });
  session.stops_asked = [] { return static_cast<int>(interrupts); };
  session.progress = [&view](const SessionProgress& progress) { view.show(progress); };
  SessionResult result = run_session(daemon, session);
  std::signal(SIGINT, SIG_DFL);
  view.finish();
  return result;
}

ExitCode run(RunOptions options, SessionSeries& series, const CommandOutput& out) {
  if (series.asked() != options.session.experiment.empty()) {
    throw InputError({"", "EXPERIMENT", series.asked() ? "is not asked for beside --shape" : "is missing",
                      "Give an experiment file, or --shape TARGET.csv --study STUDY."});
  }
  if (series.asked() && (options.dry_run || options.session.resume)) {
    throw InputError({"", options.dry_run ? "--dry-run" : "--resume", "is not for --shape",
                      "See the drive first by `diastole shape TARGET.csv --study STUDY -o drive.csv`."});
  }
  if (options.dry_run) return show_plan(read_experiment(options.session.experiment), out);
  if (options.session.output.empty()) {
    throw InputError({"", "-o", "is missing", "Name the run file to write, for example -o session.run.h5."});
  }
  std::optional<DaemonClient> daemon;  // once what is to be run is known to be good
  const auto connect = [&] {
    daemon.emplace(options.daemon.connect());
    if (options.asks && isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0)
      ask_for(options.session.facts, std::cin, stderr);
  };
  if (!series.asked()) {
    (void)read_experiment(options.session.experiment);
    connect();
    return report_session(acquire(*daemon, options.session), out.json);
  }
  const SessionSeries::Acquire acquire_next = [&](const std::string& experiment,
                                                  const std::string& run_file) {
    options.session.experiment = experiment;
    options.session.output = run_file;
    SessionResult result = acquire(*daemon, options.session);
    if (interrupts > 0 && result.end == "completed") result.end = "stopped by Ctrl-C";
    return result;
  };
  return series.carry_out(
      options.session.output, options.session.force,
      [&] {
        connect();
        return acquire_next;
      },
      out);
}

}  // namespace

void add_run(CommandLine& line, std::shared_ptr<SessionSeries> series) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = line.add(
      "run", "acquire a session through the daemon",
      "  diastole run gel.experiment.toml -o gel.run.h5\n"
      "      shows progress, trigger count and faults; Ctrl-C once stops at the end of the\n"
      "      cycle, twice at once under control; what was recorded is kept either way\n"
      "  diastole run gel.experiment.toml -o gel.run.h5 --json > gel.json\n"
      "  diastole run study.experiment.toml --dry-run\n"
      "      what it will do and how long it takes; nothing moves, and no daemon is needed\n"
      "  diastole run gel.experiment.toml -o gel.run.h5 --specimen gel-7 --operator Jo --room-temperature-C "
      "21.5\n"
      "      kept in the run file, and found again by `diastole runs specimen=gel-7`; in a terminal it asks "
      "for\n"
      "      what is not given, and Enter leaves it open\n"
      "  diastole run --shape ventricle.csv --study explained.study.toml --iterations 4 -o followed.run.h5\n"
      "      up to four sessions, followed.1.run.h5 and so on, in which the pump learns the drive by which "
      "the\n"
      "      specimen follows the curve (diastole shape); the controller checks each before anything moves\n"
      "  diastole run study.experiment.toml -o study-2.run.h5 --resume\n"
      "      goes on with a study that broke off, by a crash, a fault or a stop: slices that were imaged "
      "whole\n"
      "      are left out; nothing moves before this command. The part before is a run file of its own\n"
      "A study with prompts goes on when you press Enter, or with `diastole continue` from anywhere.\n"
      "Exit code 1: samples are missing; 3: a fault or a broken link ended the run.");
  command->add_option("EXPERIMENT", options->session.experiment, "experiment file (.toml)");
  command->add_option("-o,--output", options->session.output, "run file to write");
  CLI::Option* dry_run = command->add_flag("--dry-run", options->dry_run, "only tell what would be done");
  command
      ->add_flag("--resume", options->session.resume, "go on with the first slice that was not imaged whole")
      ->excludes(dry_run);
  command->add_flag("--force", options->session.force, "replace the run file if it exists");
  add_facts_to(*command, options->session.facts);
  command->add_flag("!--no-questions", options->asks, "ask for no facts of the session");
  options->daemon.add_to(*command);
  options->daemon.add_take_over_to(*command);
  series->add_options(*command);
  line.on_run(command, [options, series](const CommandOutput& out) { return run(*options, *series, out); });
}

}  // namespace diastole
