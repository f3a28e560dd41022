// The front door: one program, `diastole`, whose subcommands come from host/cli, estimator/cli and tools/.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/cli/commands.hpp"
#include "host/cli/host_commands.hpp"
#include "protocol/contract/command.hpp"
#include "protocol/contract/exit_code.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "tools/diastole/simulate/simulate.hpp"

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
      "fault.");
  diastole::CommandLine line(app);
  diastole::add_host_commands(line);
  diastole::add_simulate(line);
  diastole::add_estimator_commands(line);
  if (argc < 2) {
    std::cerr << app.help();
    return ExitCode::bad_input;
  }
  if (const std::string_view first = argv[1]; !first.starts_with('-') && !is_command(app, first)) {
    std::cerr << "diastole: there is no command \"" << first << "\"\n  The nearest is \""
              << diastole::nearest_word(first, commands_of(app)) << "\"; `diastole --help` lists them all.\n";
    return ExitCode::bad_input;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? ExitCode::done : ExitCode::bad_input;
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

}  // namespace

int main(int argc, char** argv) {
  try {
    return static_cast<int>(run(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "diastole: internal error: %s\n  Please report it with the command that you gave.\n",
                 error.what());
    return static_cast<int>(diastole::ExitCode::hardware_fault);
  }
}
