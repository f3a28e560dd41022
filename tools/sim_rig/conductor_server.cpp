#include "tools/sim_rig/conductor_server.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

#include "tools/sim_rig/listening_socket.hpp"

namespace diastole::sim_rig {

ConductorServer::ConductorServer(std::filesystem::path path)
    : path_(std::move(path)), listener_(listen_at(path_, "--conductor")) {}

ConductorServer::~ConductorServer() {
  disconnect();
  ::close(listener_);
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

std::optional<conductor::Advance> ConductorServer::receive() {
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

void ConductorServer::answer(const conductor::Advanced& now) {
  const conductor::Record record = conductor::encode(now);
  if (::send(client_, record.data(), record.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(record.size())) {
    disconnect();
  }
}

void ConductorServer::disconnect() {
  if (client_ >= 0) ::close(client_);
  client_ = -1;
  received_ = 0;
}

}  // namespace diastole::sim_rig
