#pragma once
// Runs one estimator command as the front door does, and keeps what it printed on standard output.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "estimator/cli/commands.hpp"

namespace diastole::test {

struct Outcome {
  ExitCode code{};
  std::string output;
};

/// What the command throws is passed on.
inline Outcome run_command(std::vector<std::string> arguments) {
  CLI::App app("test", "diastole");
  CommandLine line(app);
  add_estimator_commands(line, {});
  std::reverse(arguments.begin(), arguments.end());
  app.parse(arguments);
  testing::internal::CaptureStdout();
  Outcome outcome;
  try {
    outcome.code = line.run();
  } catch (...) {
    testing::internal::GetCapturedStdout();
    throw;
  }
  outcome.output = testing::internal::GetCapturedStdout();
  return outcome;
}

}  // namespace diastole::test
