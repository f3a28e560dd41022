#pragma once
// Unix stream sockets by path.

#include <sys/socket.h>

#include <string>

#include "host/transport/descriptor.hpp"

namespace diastole {

/// Connects. Throws HardwareError when nobody listens there or the path is too long for a socket.
Descriptor connect_unix_socket(const std::string& path);

}  // namespace diastole
