#pragma once
// A web client of bytes, without the library that the daemon is made with: HTTP/1.1 and WebSocket (RFC 6455).

#include <condition_variable>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
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
  /// Connects to 127.0.0.1. `small_window`: it reads only when it is told to, and what it does not read soon fills the
  /// way; others answer pings from the upgrade on, however long the test is busy with something else.
  explicit WebClient(int port, bool small_window = false);
  ~WebClient();
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

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
  /// The next text message. Empty when the other end closes.
  std::string receive();
  /// One JSON-RPC request and its answer, whole.
  nlohmann::json call(const std::string& method, const nlohmann::json& params = nlohmann::json::object());

 private:
  std::string take(size_t bytes);
  /// The next text message off the line; pings are answered.
  std::string read_message();
  void listen();

  int port_;
  bool small_window_;
  Descriptor socket_;
  std::string inbox_;
  std::mutex sending_;
  std::mutex mutex_;
  std::condition_variable heard_;
  std::deque<std::string> messages_;
  bool closed_ = false;
  std::thread listener_;
};

}  // namespace diastole::flow
