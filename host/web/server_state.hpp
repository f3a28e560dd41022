#pragma once
// What the browsers' connections share; used on the server's thread only.

#include <boost/asio/ip/tcp.hpp>
#include <map>
#include <memory>
#include <string>

#include "host/rpc/rpc_session.hpp"
#include "host/web/door.hpp"

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
  static constexpr size_t most_visitors =
      32;  ///< connections that fetch files; beyond it the oldest gives way
  static constexpr size_t most_consoles = 16;    ///< connections that have shown a token and speak JSON-RPC
  static constexpr int kernel_bytes = 64 << 10;  ///< that the kernel holds for one that does not read

  std::shared_ptr<RpcState> rpc_state;
  Door door;
  Connections visitors{};
  Connections consoles{};
};

/// Takes care of a connection that was accepted: answers its requests for files, and lets it in as a console when it
/// shows a token.
void receive_visitor(std::shared_ptr<ServerState> state, boost::asio::ip::tcp::socket socket);

}  // namespace diastole::web
