#include "host/web/server_state.hpp"

#include <fmt/format.h>

#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>

namespace diastole::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using beast::error_code;

constexpr std::chrono::seconds handshake_timeout{10};
constexpr std::chrono::seconds silence_timeout{10};  // a ping goes out at half of it
constexpr const char* subprotocol = "diastole";

Peer browser_at(std::string address, ConsoleRole role) {
  Peer peer;
  peer.console = std::move(address);
  peer.role = role;
  return peer;
}

class ConsoleSocket : public RpcSession, public Connection {
 public:
  ConsoleSocket(std::shared_ptr<ServerState> state, ConsoleStream stream, ConsoleRole role)
      : RpcSession(state->rpc_state, browser_at(address_of(stream.tcp().socket()), role),
                   SessionBounds::console_requests),
        state_(std::move(state)),
        stream_(std::move(stream)) {
    stream_.next_layer().tcp().expires_never();  // the WebSocket has timeouts of its own
    stream_.read_message_max(rpc::most_line_bytes);
    stream_.auto_fragment(false);
    stream_.set_option(websocket::stream_base::timeout{handshake_timeout, silence_timeout, true});
  }

  void begin(const http::request<http::empty_body>& upgrade) {
    state_->consoles[number()] = self();
    const beast::string_view offered = upgrade[http::field::sec_websocket_protocol];
    if (http::token_list(offered).exists(subprotocol)) {
      stream_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
        response.set(http::field::sec_websocket_protocol, subprotocol);
      }));
    }
    stream_.async_accept(upgrade, [self = self()](error_code error) {
      if (error) return self->close();
      self->stream_.text(true);
      self->read();
    });
  }

  void close() override {
    if (closed_) return;
    closed_ = true;
    leave();
    stream_.next_layer().close();
    state_->consoles.erase(number());
  }

 private:
  std::shared_ptr<ConsoleSocket> self() {
    return std::static_pointer_cast<ConsoleSocket>(shared_from_this());
  }

  void read() {
    stream_.async_read(inbox_, [self = self()](error_code error, size_t) {
      if (error == websocket::error::message_too_big) {
        return self->drop(fmt::format("sent a message longer than {} bytes", rpc::most_line_bytes));
      }
      if (error) return self->close();
      self->held_ = beast::buffers_to_string(self->inbox_.data());
      self->inbox_.clear();
      self->take_more();
    });
  }

  void take_more() override {
    if (closed_ || !held_ || !may_take()) return;
    answer(*std::exchange(held_, std::nullopt));
    if (!closed_) read();
  }

  [[nodiscard]] bool is_open() const override { return !closed_; }

  void write(const std::string& message) override {
    stream_.async_write(asio::buffer(message), [self = self()](error_code error, size_t) {
      if (error) return self->close();
      self->written();
    });
  }

  std::shared_ptr<ServerState> state_;
  websocket::stream<ConsoleStream> stream_;
  beast::flat_buffer inbox_;
  std::optional<std::string> held_;  // read, and not yet taken
  bool closed_ = false;
};

}  // namespace

void open_console(const std::shared_ptr<ServerState>& state, ConsoleStream stream,
                  http::request<http::empty_body> upgrade, ConsoleRole role) {
  std::make_shared<ConsoleSocket>(state, std::move(stream), role)->begin(upgrade);
}

std::string address_of(const tcp::socket& socket) {
  error_code error;
  const auto endpoint = socket.remote_endpoint(error);
  return error ? "an unknown address" : endpoint.address().to_string();
}

}  // namespace diastole::web
