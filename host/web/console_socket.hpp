#pragma once
// One browser that has shown its token: JSON-RPC 2.0 in text messages of a WebSocket, at most rpc::most_line_bytes
// each, by the rules of rpc_session.hpp. A browser that answers no ping for some seconds is gone, and its control
// with it.

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <memory>

#include "host/web/server_state.hpp"

namespace diastole::web {

void open_console(const std::shared_ptr<ServerState>& state, boost::asio::ip::tcp::socket socket,
                  boost::beast::http::request<boost::beast::http::empty_body> upgrade, ConsoleRole role);

/// "127.0.0.1", or "an unknown address".
std::string address_of(const boost::asio::ip::tcp::socket& socket);

}  // namespace diastole::web
