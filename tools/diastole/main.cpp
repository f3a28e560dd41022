// The front door: one program, `diastole`, whose subcommands come from host/cli, estimator/cli and tools/.

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "estimator/cli/commands.hpp"
#include "host/cli/host_commands.hpp"
#include "protocol/contract/command.hpp"
#include "protocol/contract/exit_code.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/diastole/refusal.hpp"
#include "tools/score/score.hpp"

namespace {

constexpr const char* overview =
    R"(Diastole finds how stiff a soft tissue is: it moves a pump that inflates the specimen in an MR scanner,
records the pressure, and fits the material law to pressure and imaged motion.

A first session, in simulated hardware:
  diastole simulate examples/gel.experiment.toml -o gel.run.h5
  diastole inspect gel.run.h5
  diastole bin gel.run.h5 --frames 16
  diastole fit examples/phantom-a.study.toml
)";

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({}))
    names.push_back(command->get_name());
  return names;
}

bool is_command(const CLI::App& app, std::string_view name) {
  const std::vector<std::string> names = commands_of(app);
  return std::find(names.begin(), names.end(), name) != names.end();
}

diastole::ExitCode run(int argc, char** argv) {
  using diastole::ExitCode;
  CLI::App app(overview, "diastole");
  app.set_version_flag("--version", "diastole " DIASTOLE_VERSION);
  app.require_subcommand(1);
  app.footer(
      "`diastole COMMAND --help` explains a command with examples.\n"
      "Exit codes: 0 done, 1 it ran but the answer is negative, 2 wrong usage or input, 3 hardware or link "
      "fault.\n"
      "With --json, standard output holds one JSON document; after exit code 2 or 3 it may be empty: the "
      "exit code\nand the text on standard error tell the error.");
  diastole::CommandLine line(app);
  diastole::add_host_commands(line, diastole::make_shape_series());
  diastole::add_runs(line);
  diastole::add_batch(line);
  diastole::add_compare(line);
  diastole::add_catheter(line);
  diastole::add_simulate(line, diastole::make_shape_series());
  diastole::add_shape(line);
  diastole::add_replay(line);
  diastole::add_scan(line);
  diastole::add_desk(line);
  diastole::add_estimator_commands(line, diastole::explain::print_score);
  if (argc < 2) {
    std::cerr << app.help();
    return ExitCode::bad_input;
  }
  if (const std::string_view first = argv[1]; !first.starts_with('-') && !is_command(app, first)) {
    std::cerr << "diastole: there is no command \"" << first << "\"\n  "
              << diastole::did_you_mean(first, commands_of(app)) << "`diastole --help` lists them all.\n";
    return ExitCode::bad_input;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    app.exit(asked);
    return ExitCode::done;
  } catch (const CLI::ParseError& error) {
    std::cerr << "diastole: " << diastole::refusal(app, error) << '\n';
    return ExitCode::bad_input;
  }
  try {
    return line.run();
  } catch (const diastole::InputError& error) {
    std::cerr << "diastole: " << error.what() << '\n';
    return ExitCode::bad_input;
  } catch (const diastole::HardwareError& error) {
    std::cerr << "diastole: " << error.what() << '\n';
    return ExitCode::hardware_fault;
  }
}

ssize_t write_or_drop(void*, const char* text, size_t size) {
  for (size_t written = 0; written < size;) {
    const ssize_t count = ::write(STDERR_FILENO, text + written, size - written);
    if (count <= 0) break;
    written += static_cast<size_t>(count);
  }
  return static_cast<ssize_t>(size);
}

/// Progress that nobody reads any more, as in `diastole simulate ... 2>&1 | head -1`, must not end the work:
/// what cannot be written to standard error is dropped.
void let_standard_error_drop() {
  const cookie_io_functions_t functions{
      .read = nullptr, .write = write_or_drop, .seek = nullptr, .close = nullptr};
  std::FILE* dropping = ::fopencookie(nullptr, "w", functions);
  if (dropping == nullptr) return;
  std::setvbuf(dropping, nullptr, _IONBF, 0);
  stderr = dropping;
}

bool reader_has_gone() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

/// Standard output did not take what was printed. A reader that has gone (`diastole inspect x | head -1`) ends
/// a program quietly, by the signal that it expects.
diastole::ExitCode not_delivered() {
  if (reader_has_gone()) {
    std::signal(SIGPIPE, SIG_DFL);
    std::raise(SIGPIPE);
  }
  std::fputs("diastole: standard output cannot be written\n  Make room, or send it elsewhere.\n", stderr);
  return diastole::ExitCode::bad_input;
}

diastole::ExitCode run_and_deliver(int argc, char** argv) {
  try {
    const diastole::ExitCode code = run(argc, argv);
    return std::cout.flush().good() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0 ? code
                                                                                            : not_delivered();
  } catch (const std::system_error&) {
    if (std::ferror(stdout) != 0) return not_delivered();
    throw;
  }
}

}  // namespace

int main(int argc, char** argv) {
  // A closed pipe or a file grown too large is an error of that write, not the end of a session.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  let_standard_error_drop();
  try {
    return static_cast<int>(run_and_deliver(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "diastole: internal error: %s\n  Please report it with the command that you gave.\n",
                 error.what());
    return static_cast<int>(diastole::ExitCode::hardware_fault);
  }
}
