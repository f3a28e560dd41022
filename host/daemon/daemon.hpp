#pragma once
// The daemon as a program.

#include <optional>
#include <string>

namespace diastole {

struct DaemonOptions {
  std::string config;     ///< rig file
  std::string conductor;  ///< socket of a simulated rig that conducts time; empty: real time
  std::optional<std::string> port;
  std::optional<std::string> daq_address;
  std::optional<std::string> socket;
  std::optional<std::string> journal_dir;
  std::optional<std::string> console;  ///< [ADDRESS:]PORT of the web console (host/web/access_policy.hpp)
  std::string producer;                ///< "diastole 0.1.0"
};

/// Serves until SIGINT or SIGTERM, then stops motion under control and closes. When it is ready to serve, one
/// line appears on standard output: {"ready":true,"socket":"...","console":{"control":"http://...","watch":"http://..."}}
/// (the latter with --console only), and a supervisor is notified
/// (host/rig/service_manager.hpp); the log goes to standard error. Throws InputError or HardwareError when it cannot
/// start.
void run_daemon(const DaemonOptions& options);

}  // namespace diastole
