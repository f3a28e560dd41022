#pragma once
// The rig's side of conducted time (protocol/contract/conductor.hpp): a unix stream socket, one daemon at a
// time.

#include <filesystem>
#include <optional>

#include "protocol/contract/conductor.hpp"

namespace diastole::sim_rig {

class ConductorServer {
 public:
  /// Listens at `path` (a stale socket there is replaced). Throws HardwareError when it cannot.
  explicit ConductorServer(std::filesystem::path path);
  ~ConductorServer();
  ConductorServer(const ConductorServer&) = delete;
  ConductorServer& operator=(const ConductorServer&) = delete;

  /// To wait for: the connected daemon, or the listening socket while there is none.
  [[nodiscard]] int descriptor() const { return client_ >= 0 ? client_ : listener_; }
  /// Call when descriptor() is readable. The daemon's question, if a whole one has come.
  std::optional<conductor::Advance> receive();
  [[nodiscard]] bool connected() const { return client_ >= 0; }
  void answer(const conductor::Advanced& now);

 private:
  void disconnect();

  std::filesystem::path path_;
  int listener_ = -1;
  int client_ = -1;
  conductor::Record record_{};
  size_t received_ = 0;
};

}  // namespace diastole::sim_rig
