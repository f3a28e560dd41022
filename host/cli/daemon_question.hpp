#pragma once
// Where a command finds the daemon; commands that ask it one question and show its answer.

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host/config/rig_config.hpp"
#include "host/rpc/client.hpp"
#include "protocol/contract/command.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {

/// Where a command finds the daemon: --socket, or the socket that a rig file names, or the user's own daemon, or
/// the system's service; and how it gets the control.
struct DaemonAddress {
  std::string socket;
  std::string config;
  std::string take_over;

  void add_to(CLI::App& command) {
    auto* socket_option = command.add_option("--socket", socket, "the daemon's socket");
    command.add_option("--config", config, "rig file that names the socket")->excludes(socket_option);
  }
  /// For commands that give orders.
  void add_take_over_to(CLI::App& command) {
    command.add_option("--take-over", take_over,
                       "take the control from the user (or process number) who holds it; the log names both");
  }
  /// A client of the daemon, which has taken over the control if that was asked for.
  [[nodiscard]] DaemonClient connect() const {
    DaemonClient client(resolve());
    if (!take_over.empty()) client.call("control.take", {{"take_over", take_over}});
    return client;
  }
  [[nodiscard]] std::string resolve() const {
    if (!socket.empty()) return socket;
    if (!config.empty()) return read_rig(config).daemon.socket;
    std::error_code ignored;
    const bool own = std::filesystem::exists(default_socket(), ignored);
    return !own && std::filesystem::exists(service_socket, ignored) ? service_socket : default_socket();
  }
};

struct DaemonQuestion {
  std::string command;
  std::string purpose;
  std::string examples;
  std::string method;
  std::function<void(const nlohmann::json& answer)> show;  ///< for a person
  bool gives_order = false;                                ///< then it may take the control over
  std::chrono::seconds timeout{30};
  /// Exit code 1 if it says no.
  std::function<bool(const nlohmann::json& answer)> positive = [](const nlohmann::json&) { return true; };
};

/// One JSON document on standard output, as --json promises.
inline void print_json(const nlohmann::json& document) { std::cout << json_text(document, 2) << '\n'; }
/// The same with --json; else `show()` prints for a person.
inline void print(const CommandOutput& out, const nlohmann::json& document,
                  const std::function<void()>& show) {
  out.json ? print_json(document) : show();
}

inline void add_question(CommandLine& line, const DaemonQuestion& question) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command = line.add(question.command, question.purpose, question.examples);
  daemon->add_to(*command);
  if (question.gives_order) daemon->add_take_over_to(*command);
  line.on_run(command, [daemon, question](const CommandOutput& out) {
    DaemonClient client = daemon->connect();
    const nlohmann::json answer = client.call(question.method, nlohmann::json::object(), question.timeout);
    print(out, answer, [&] { question.show(answer); });
    return question.positive(answer) ? ExitCode::done : ExitCode::negative;
  });
}

}  // namespace diastole
