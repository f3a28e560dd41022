#pragma once
// A simulated rig, and a daemon that can be started at it more than once.

#include <memory>
#include <string>
#include <vector>

#include "host/rpc/client.hpp"
#include "host/transport/descriptor.hpp"
#include "tests/flow/programs.hpp"

namespace diastole::flow {

class RigWithDaemon {
 public:
  enum class Time { conducted, real };

  /// In real time the rig file gets the longest lease.
  explicit RigWithDaemon(Time time, const std::string& rig_file = source_text("examples/rig.toml"),
                         const std::vector<std::string>& rig_options = {});
  /// Ends both, which must go well.
  ~RigWithDaemon();
  RigWithDaemon(const RigWithDaemon&) = delete;
  RigWithDaemon& operator=(const RigWithDaemon&) = delete;

  /// Returns when it serves. `before` goes before the command: {"/usr/bin/env", "NAME=VALUE"}.
  void start_daemon(const std::vector<std::string>& before = {});
  [[nodiscard]] DaemonClient client() const { return DaemonClient(path("socket")); }
  /// The simulated rig's program.
  [[nodiscard]] const Program& rig() const { return *rig_; }
  /// Ends it before its time, after the daemon; its pin trace is whole then.
  void end_rig();
  [[nodiscard]] std::string path(const std::string& name) const { return (place / name).string(); }

  Workplace place;
  std::vector<std::string> daemon_options;  ///< more of them
  std::unique_ptr<Program> daemon;

 private:
  Time time_;
  std::unique_ptr<Program> rig_;
  int modbus_port_ = 0;
};

/// An experiment for run.start: 60 segments, which take a while to load, and 18 s to run.
nlohmann::json many_segments();

/// Asks until the state is (or is no longer) `state`, half a minute at most; returns the last status.
nlohmann::json status_when(DaemonClient& client, const std::string& state, bool is);

/// Homes the pump and leaves the control to others.
nlohmann::json home(DaemonClient& client);

/// A client that gives an order and does not wait for the answer.
class Hasty {
 public:
  Hasty(const std::string& socket, const std::string& method, const nlohmann::json& params);

 private:
  Descriptor socket_;
};

}  // namespace diastole::flow
