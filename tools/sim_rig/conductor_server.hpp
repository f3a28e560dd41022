#pragma once
// The rig's side of conducted time (protocol/contract/conductor.hpp): a unix stream socket, one daemon at a
// time.

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <optional>

#include "protocol/contract/conductor.hpp"
#include "tools/sim_rig/listening_socket.hpp"

namespace diastole::sim_rig {

class ConductorServer {
 public:
  /// Listens at `path` (a stale socket there is replaced). Throws HardwareError when it cannot.
  explicit ConductorServer(std::filesystem::path path)
      : path_(std::move(path)), listener_(listen_at(path_, "--conductor")) {}
  ~ConductorServer() {
    disconnect();
    ::close(listener_);
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  ConductorServer(const ConductorServer&) = delete;
  ConductorServer& operator=(const ConductorServer&) = delete;

  /// To wait for: the connected daemon, or the listening socket while there is none.
  [[nodiscard]] int descriptor() const { return client_ >= 0 ? client_ : listener_; }
  /// Call when descriptor() is readable. The daemon's question, if a whole one has come.
  std::optional<conductor::Advance> receive() {
    if (client_ < 0) {
      client_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      return std::nullopt;
    }
    const ssize_t got = ::read(client_, record_.data() + received_, record_.size() - received_);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) disconnect();
    if (got > 0) received_ += static_cast<size_t>(got);
    if (received_ < record_.size()) return std::nullopt;
    received_ = 0;
    return conductor::decode_advance(record_);
  }
  [[nodiscard]] bool connected() const { return client_ >= 0; }
  void answer(const conductor::Advanced& now) {
    const conductor::Record record = conductor::encode(now);
    if (::send(client_, record.data(), record.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(record.size())) {
      disconnect();
    }
  }

 private:
  void disconnect() {
    if (client_ >= 0) ::close(client_);
    client_ = -1;
    received_ = 0;
  }

  std::filesystem::path path_;
  int listener_ = -1;
  int client_ = -1;
  conductor::Record record_{};
  size_t received_ = 0;
};

}  // namespace diastole::sim_rig
