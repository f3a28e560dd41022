#pragma once
// A web client of bytes, without the library that the daemon is made with: HTTP/1.1 and WebSocket (RFC 6455).

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "host/transport/descriptor.hpp"

namespace diastole::flow {

struct WebAnswer {
  int status = 0;  ///< 0: the connection was closed without an answer
  std::string headers;
  std::string body;
};

class WebClient {
 public:
  /// Connects to 127.0.0.1. `small_window`: what it does not read soon fills the way.
  explicit WebClient(int port, bool small_window = false);

  /// Sends bytes as they are; false if the other end is gone.
  bool send(std::string_view bytes);
  /// Sends a request with these header lines ("Name: value") beside a fitting Host, which `host` replaces.
  WebAnswer get(const std::string& path, const std::vector<std::string>& headers = {}, std::string host = "");
  WebAnswer read_answer();
  /// Opens /rpc with a token and asks for an upgrade.
  WebAnswer upgrade(const std::string& token, const std::vector<std::string>& headers = {});

  /// One frame, masked as a client must.
  bool send_frame(int opcode, std::string_view payload, bool last = true);
  bool send_text(std::string_view text) { return send_frame(1, text); }
  /// The next text message; pings are answered. Empty when the other end closes.
  std::string receive();
  /// One JSON-RPC request and its answer, whole.
  nlohmann::json call(const std::string& method, const nlohmann::json& params = nlohmann::json::object());

 private:
  std::string take(size_t bytes);

  int port_;
  Descriptor socket_;
  std::string inbox_;
};

}  // namespace diastole::flow
