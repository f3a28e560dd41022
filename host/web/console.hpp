#pragma once
// The web console: the daemon's second endpoint, for browsers.
//
//   GET /, /console.css, ...   the page, from this program itself; anybody may have it, it holds no secret
//   GET /role                  {"role": "control"|"watch"}, as the token says; 401 without a valid one
//   GET /rpc                   with a token: a WebSocket that speaks JSON-RPC 2.0, one object a text message, with the
//                              methods of host/rpc/server.hpp by the rules of host/rpc/rpc_session.hpp
//
// The token comes as "Authorization: Bearer TOKEN" or as the WebSocket's sub-protocol "token.TOKEN"; Host and Origin
// are checked first (access_policy.hpp). An operator signs in with a name (console.sign_in) before he gives orders.
//
// From another machine all this comes encrypted (console_stream.hpp); plain HTTP is refused with a sentence.
//
// It runs on the server's thread, never on the one that acquires, and holds a bounded number of connections with a
// bounded number of bytes each (server_state.hpp, host/rpc/rpc_session.hpp).

#include <filesystem>
#include <memory>
#include <string>

#include "host/web/access_policy.hpp"

namespace diastole {

struct RpcState;

namespace web {

class ConsoleServer {
 public:
  /// Listens at `address`, and lets users at the socket ask for the addresses (console.address). Beyond this machine it speaks TLS
  /// only, with `certificate` (certificate.hpp). Throws HardwareError if it cannot listen there, or has no certificate.
  ConsoleServer(std::shared_ptr<RpcState> rpc_state, const ConsoleAddress& address,
                const std::filesystem::path& certificate);
  ~ConsoleServer();

  /// For the browser of somebody who may control, or only watch and stop; with the token.
  [[nodiscard]] std::string url(ConsoleRole role) const;

 private:
  class Listener;
  std::shared_ptr<Listener> listener_;
};

}  // namespace web
}  // namespace diastole
