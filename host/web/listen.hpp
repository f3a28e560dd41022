#pragma once
// Opens a socket at which browsers connect.

#include <utility>  // before Asio, which uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>
#include <string>

namespace diastole::web {

/// Opens `acceptor` at `endpoint`; connections may come from then on. Throws HardwareError that names `what` if it cannot, and
/// `option`, by which another port is asked for: "--port".
void listen_at(boost::asio::ip::tcp::acceptor& acceptor, const boost::asio::ip::tcp::endpoint& endpoint,
               const std::string& what, const std::string& option);

}  // namespace diastole::web
