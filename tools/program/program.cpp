#include "tools/program/program.hpp"

#include <sys/signalfd.h>

#include <csignal>
#include <iostream>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

ExitCode parse_and_run(CLI::App& app, int argc, char** argv, const std::function<ExitCode()>& action) {
  try {
    app.parse(argc, argv);
    return action();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? ExitCode::done : ExitCode::bad_input;
  } catch (const InputError& error) {
    std::cerr << app.get_name() << ": " << error.what() << '\n';
    return ExitCode::bad_input;
  } catch (const HardwareError& error) {
    std::cerr << app.get_name() << ": " << error.what() << '\n';
    return ExitCode::hardware_fault;
  }
}

}  // namespace

int stop_descriptor() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(-1, &signals, SFD_CLOEXEC);
}

int run_program(CLI::App& app, int argc, char** argv, const std::function<ExitCode()>& action) {
  return static_cast<int>(parse_and_run(app, argc, argv, action));
}

}  // namespace diastole
