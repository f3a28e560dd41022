#include "tools/sim_rig/listening_socket.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {

int listen_at(const std::filesystem::path& path, const char* option) {
  constexpr int queued_connections = 4;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.native().size() >= sizeof address.sun_path) {
    throw HardwareError(path.string(), "the path is too long for a socket",
                        fmt::format("Use at most {} characters.", sizeof address.sun_path - 1));
  }
  std::memcpy(address.sun_path, path.c_str(), path.native().size() + 1);
  if (std::filesystem::is_socket(path)) std::filesystem::remove(path);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      ::listen(listener, queued_connections) == 0) {
    return listener;
  }
  const int error = errno;
  ::close(listener);
  throw HardwareError(path.string(), fmt::format("cannot listen here: {}", std::strerror(error)),
                      fmt::format("Choose a directory in which you may write for {}.", option));
}

}  // namespace diastole::sim_rig
