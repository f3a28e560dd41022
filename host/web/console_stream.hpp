#pragma once
// A browser's connection, encrypted or not: what the console's HTTP and WebSocket read and write, so that both are compiled once.

#include <utility>  // before Asio, which uses std::exchange without it

#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <memory>

namespace diastole::web {

/// An AsyncStream of Boost.Beast.
class ConsoleStream {
 public:
  using executor_type = boost::beast::tcp_stream::executor_type;

  /// `tls`: null for plain bytes.
  ConsoleStream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls)
      : plain_(tls == nullptr ? std::make_unique<boost::beast::tcp_stream>(std::move(socket)) : nullptr),
        tls_(tls == nullptr ? nullptr : std::make_unique<Encrypted>(std::move(socket), *tls)) {}

  [[nodiscard]] bool encrypted() const { return tls_ != nullptr; }
  /// Precondition: encrypted.
  template <typename Handler>
  void async_handshake(Handler&& handler) {
    tls_->async_handshake(boost::asio::ssl::stream_base::server, std::forward<Handler>(handler));
  }
  /// What lies below the encryption.
  [[nodiscard]] boost::beast::tcp_stream& tcp() { return tls_ ? tls_->next_layer() : *plain_; }
  void close() { tcp().close(); }

  [[nodiscard]] executor_type get_executor() { return tcp().get_executor(); }
  template <typename Buffers, typename Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) return tls_->async_read_some(buffers, std::forward<Handler>(handler));
    plain_->async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <typename Buffers, typename Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) return tls_->async_write_some(buffers, std::forward<Handler>(handler));
    plain_->async_write_some(buffers, std::forward<Handler>(handler));
  }

 private:
  using Encrypted = boost::asio::ssl::stream<boost::beast::tcp_stream>;
  std::unique_ptr<boost::beast::tcp_stream> plain_;
  std::unique_ptr<Encrypted> tls_;
};

// What Beast's WebSocket asks of its stream: to end it.

inline void beast_close_socket(ConsoleStream& stream) { stream.close(); }

inline void teardown(boost::beast::role_type, ConsoleStream& stream, boost::system::error_code& error) {
  stream.close();
  error = {};
}

template <typename Handler>
void async_teardown(boost::beast::role_type, ConsoleStream& stream, Handler&& handler) {
  stream.close();
  boost::asio::post(stream.get_executor(), boost::beast::bind_front_handler(std::forward<Handler>(handler),
                                                                            boost::system::error_code{}));
}

}  // namespace diastole::web
