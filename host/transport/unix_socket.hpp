#pragma once
// Unix stream sockets by path.

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

/// Connects. Throws HardwareError, with `remedy` when nobody listens there, or when the path is too long for a socket.
inline Descriptor connect_unix_socket(const std::string& path,
                                      const std::string& remedy =
                                          "Start the daemon (diastole daemon --config rig.toml), or "
                                          "name its socket with --socket.") {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) {
    throw HardwareError(path, "the path is too long for a socket", "Choose a shorter directory.");
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    throw HardwareError(path, fmt::format("nobody answers at this socket ({})", std::strerror(errno)),
                        remedy);
  }
  return socket;
}

}  // namespace diastole
