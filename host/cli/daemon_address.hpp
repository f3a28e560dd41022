#pragma once
// Where a command finds the daemon: --socket, or the socket that a rig file names, or the default.

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "host/config/rig_config.hpp"

namespace diastole {

struct DaemonAddress {
  std::string socket;
  std::string config;

  void add_to(CLI::App& command) {
    auto* socket_option = command.add_option("--socket", socket, "the daemon's socket");
    command.add_option("--config", config, "rig file that names the socket")->excludes(socket_option);
  }
  [[nodiscard]] std::string resolve() const {
    if (!socket.empty()) return socket;
    return config.empty() ? default_socket() : read_rig(config).daemon.socket;
  }
};

}  // namespace diastole
