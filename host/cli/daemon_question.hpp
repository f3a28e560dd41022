#pragma once
// Commands that ask the daemon one question and show its answer.

#include <chrono>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/cli/daemon_address.hpp"
#include "protocol/contract/command.hpp"

namespace diastole {

struct DaemonQuestion {
  std::string command;
  std::string purpose;
  std::string examples;
  std::string method;
  std::function<void(const nlohmann::json& answer)> show;  ///< for a person
  bool gives_order = false;                                ///< then it may take the control over
  std::chrono::seconds patience{30};
  /// Exit code 1 if it says no.
  std::function<bool(const nlohmann::json& answer)> positive = [](const nlohmann::json&) { return true; };
};

void add_question(CommandLine& line, const DaemonQuestion& question);

/// One JSON document on standard output, as --json promises.
void print_json(const nlohmann::json& document);
/// The same with --json; else `show()` prints for a person.
void print(const CommandOutput& out, const nlohmann::json& document, const std::function<void()>& show);

}  // namespace diastole
