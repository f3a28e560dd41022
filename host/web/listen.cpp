#include "host/web/listen.hpp"

#include <fmt/format.h>

#include "protocol/contract/input_error.hpp"

namespace diastole::web {

void listen_at(boost::asio::ip::tcp::acceptor& acceptor, const boost::asio::ip::tcp::endpoint& endpoint,
               const std::string& what, const std::string& option) {
  try {
    acceptor.open(endpoint.protocol());
    acceptor.set_option(boost::asio::socket_base::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
  } catch (const boost::system::system_error& error) {
    throw HardwareError(what,
                        fmt::format("cannot listen at {}:{}: {}", endpoint.address().to_string(),
                                    endpoint.port(), error.code().message()),
                        fmt::format("Choose another port ({}), or see who has this one (ss -ltnp).", option));
  }
}

}  // namespace diastole::web
