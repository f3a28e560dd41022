#pragma once
// Where a command finds the daemon: --socket, or the socket that a rig file names, or the user's own daemon, or
// the system's service; and how it gets the control.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "host/config/rig_config.hpp"
#include "host/rpc/client.hpp"

namespace diastole {

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
                       "take the control from the user (or process number) who holds it; the log tells both");
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

}  // namespace diastole
