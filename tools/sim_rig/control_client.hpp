#pragma once
// The other end of a rig's control socket (server.hpp): what `sim_rig ctl` and `diastole replay` use.

#include <chrono>
#include <optional>
#include <string>

#include "host/transport/descriptor.hpp"

namespace diastole::sim_rig {

class ControlClient {
 public:
  /// Throws HardwareError when no rig listens there.
  explicit ControlClient(const std::string& socket);

  /// One order, one answer, without its "ok ". Throws InputError with what the rig refuses, HardwareError when it has
  /// gone or does not answer.
  std::string order(const std::string& text);
  /// The moment for which a hold was ordered, if it has come.
  std::optional<std::string> held();

 private:
  /// The next whole line, if it comes in time.
  std::optional<std::string> line(std::chrono::milliseconds patience);

  std::string path_;
  Descriptor socket_;
  std::string inbox_;
  std::optional<std::string> held_;
};

}  // namespace diastole::sim_rig
