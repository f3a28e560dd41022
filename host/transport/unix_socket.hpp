#pragma once
// Unix stream sockets by path.

#include <sys/socket.h>

#include <string>

#include "host/transport/descriptor.hpp"

namespace diastole {

/// Connects. Throws HardwareError, with `remedy` when nobody listens there, or when the path is too long for a socket.
Descriptor connect_unix_socket(const std::string& path,
                               const std::string& remedy =
                                   "Start the daemon (diastole daemon --config rig.toml), or "
                                   "name its socket with --socket.");

}  // namespace diastole
