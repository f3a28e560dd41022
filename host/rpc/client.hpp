#pragma once
// The daemon from outside: what the commands `run`, `status`, `stop`, `home` use.

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "host/transport/descriptor.hpp"

namespace diastole {

class DaemonClient {
 public:
  /// Connects. Throws HardwareError if no daemon listens there.
  explicit DaemonClient(const std::string& socket);

  /// One request, one answer. Throws InputError or HardwareError as the daemon raised it, HardwareError if
  /// the daemon is gone, silent for longer than `patience`, or refuses.
  nlohmann::json call(const std::string& method, const nlohmann::json& params = nlohmann::json::object(),
                      std::chrono::seconds patience = std::chrono::seconds(30));

 private:
  std::string read_line(std::chrono::seconds patience);

  std::string path_;
  Descriptor socket_;
  std::string inbox_;
  int64_t next_id_ = 1;
};

}  // namespace diastole
