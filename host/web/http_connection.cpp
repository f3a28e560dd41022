// One TCP connection as long as it speaks HTTP: GET of the page's files, of /role, and the upgrade to /rpc.

#include <fmt/format.h>

#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>

#include "host/web/request.hpp"
#include "host/web/server_state.hpp"

namespace diastole::web {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using boost::asio::ip::tcp;
using boost::beast::error_code;

constexpr std::chrono::seconds request_timeout{10};
constexpr int most_requests = 100;  // of one connection

using Response = http::response<http::string_body>;

class HttpConnection : public Connection, public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(std::shared_ptr<ServerState> state, tcp::socket socket)
      : state_(std::move(state)),
        stream_(std::move(socket), state_->tls ? &*state_->tls : nullptr),
        number_(++state_->rpc_state->last_number) {}

  void begin() {
    state_->http_connections[number_] = shared_from_this();
    if (!stream_.encrypted()) return read();
    stream_.tcp().expires_after(request_timeout);
    stream_.async_handshake([self = shared_from_this()](error_code error) {
      if (!error) return self->read();
      const int reason = ERR_GET_REASON(static_cast<unsigned long>(error.value()));
      reason == SSL_R_HTTP_REQUEST ? self->refuse_plain() : self->close();
    });
  }

  void close() override {
    state_->http_connections.erase(number_);
    stream_.close();
  }

 private:
  /// To whoever speaks HTTP without encryption: beyond this machine a token in it could be read by others.
  void refuse_plain() {
    constexpr std::string_view answer =
        "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n\r\n"
        "This console is reached by https:// only: open the address that the daemon printed.\n";
    boost::asio::async_write(stream_.tcp(), boost::asio::buffer(answer),
                             [self = shared_from_this()](error_code, size_t) { self->close(); });
  }

  void read() {
    parser_.emplace();
    set_bounds(*parser_);
    stream_.tcp().expires_after(request_timeout);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, size_t) { self->take(error); });
  }

  void take(error_code error) {
    if (error.category() == make_error_code(http::error::end_of_stream).category() &&
        error != http::error::end_of_stream) {
      return refuse(no_request(error));
    }
    if (error) return close();
    request_ = parser_->release();
    const Verdict verdict =
        judge(state_->policy, request_, state_->consoles.size(), ServerState::most_consoles);
    if (verdict.refusal) return refuse(*verdict.refusal);
    if (verdict.let_in_as) return open_socket(*verdict.let_in_as);
    if (verdict.page != nullptr) return reply(200, verdict.page->type, std::string(verdict.page->text));
    reply(200, "application/json",
          *verdict.asked_role == ConsoleRole::control ? R"({"role":"control"})" : R"({"role":"watch"})");
  }

  void open_socket(ConsoleRole role) {
    state_->http_connections.erase(number_);
    open_console(state_, std::move(stream_), std::move(request_), role);
  }

  void refuse(const Refusal& refusal) {
    if (refusal.status == 401) {
      state_->rpc_state->log.warn(fmt::format("a browser at {} came to the console without a valid token",
                                              address_of(stream_.tcp().socket())));
    }
    last_ = true;
    reply(refusal.status, "text/plain; charset=utf-8", refusal.sentence + "\n");
  }

  void reply(int status, std::string_view type, std::string body) {
    last_ = last_ || !request_.keep_alive() || ++answered_ >= most_requests;
    response_ = Response(static_cast<http::status>(status), 11);
    response_.set(http::field::content_type, beast::string_view(type.data(), type.size()));
    set_page_headers(response_);
    response_.keep_alive(!last_);
    response_.body() = std::move(body);
    response_.prepare_payload();
    stream_.tcp().expires_after(request_timeout);
    http::async_write(stream_, response_, [self = shared_from_this()](error_code error, size_t) {
      if (error || self->last_) return self->close();
      self->read();
    });
  }

  std::shared_ptr<ServerState> state_;
  ConsoleStream stream_;
  uint64_t number_;
  beast::flat_buffer buffer_{2 * most_header_bytes};
  std::optional<RequestParser> parser_;
  Request request_;
  Response response_;
  int answered_ = 0;
  bool last_ = false;
};

}  // namespace

void accept_connection(std::shared_ptr<ServerState> state, tcp::socket socket) {
  if (state->http_connections.size() >= ServerState::most_http_connections) {
    const auto oldest = state->http_connections.begin()->second;
    oldest->close();
  }
  error_code ignored;
  socket.set_option(boost::asio::socket_base::send_buffer_size(ServerState::kernel_bytes), ignored);
  std::make_shared<HttpConnection>(std::move(state), std::move(socket))->begin();
}

}  // namespace diastole::web
