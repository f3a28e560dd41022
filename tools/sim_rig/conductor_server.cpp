#include "tools/sim_rig/conductor_server.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {

ConductorServer::ConductorServer(std::filesystem::path path) : path_(std::move(path)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.native().size() >= sizeof address.sun_path) {
    throw HardwareError(path_.string(), "the path is too long for a socket",
                        fmt::format("Use at most {} characters.", sizeof address.sun_path - 1));
  }
  std::memcpy(address.sun_path, path_.c_str(), path_.native().size() + 1);
  if (std::filesystem::is_socket(path_)) std::filesystem::remove(path_);
  listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_, 1) != 0) {
    const int error = errno;
    ::close(listener_);
    throw HardwareError(path_.string(), fmt::format("cannot listen here: {}", std::strerror(error)),
                        "Choose a directory in which you may write for --conductor.");
  }
}

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
