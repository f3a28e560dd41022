#pragma once
// What the browsers' connections share; used on the server's thread only.

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "host/rpc/rpc_session.hpp"
#include "host/web/access_policy.hpp"
#include "host/web/console_stream.hpp"

namespace diastole::web {

/// One TCP connection.
class Connection {
 public:
  virtual ~Connection() = default;
  /// At once; it takes itself off its list.
  virtual void close() = 0;
};

using Connections = std::map<uint64_t, std::shared_ptr<Connection>>;  // the oldest first

struct ServerState {
  static constexpr size_t most_http_connections =
      32;  ///< connections that fetch files; beyond it the oldest gives way
  static constexpr size_t most_consoles = 16;    ///< connections that have shown a token and speak JSON-RPC
  static constexpr int kernel_bytes = 64 << 10;  ///< that the kernel holds for one that does not read

  std::shared_ptr<RpcState> rpc_state;
  AccessPolicy policy;
  std::optional<boost::asio::ssl::context> tls;  ///< none: only this machine reaches the console
  Connections http_connections{};
  Connections consoles{};
};

/// Takes care of a connection that was accepted: answers its requests for files, and lets it in as a console when it
/// shows a token.
void accept_connection(std::shared_ptr<ServerState> state, boost::asio::ip::tcp::socket socket);

/// One browser that has shown its token: JSON-RPC 2.0 in text messages of a WebSocket, at most rpc::most_line_bytes
/// each, by the rules of host/rpc/rpc_session.hpp. A browser that answers no ping for some seconds is gone, and its control
/// with it.
void open_console(const std::shared_ptr<ServerState>& state, ConsoleStream stream,
                  boost::beast::http::request<boost::beast::http::empty_body> upgrade, ConsoleRole role);

/// "127.0.0.1", or "an unknown address".
std::string address_of(const boost::asio::ip::tcp::socket& socket);

}  // namespace diastole::web
