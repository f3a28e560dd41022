#pragma once
// A browser's connection, encrypted or not: what the console's HTTP and WebSocket read and write. Their many kinds of
// buffers and handlers become one each here, so that Asio's operations on a socket are compiled once.

#include <utility>  // before Asio, which uses std::exchange without it

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/buffers_range.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/container/static_vector.hpp>
#include <functional>
#include <memory>

namespace diastole::web {

/// An AsyncStream of Boost.Beast, for handlers that run on the stream's own executor.
class ConsoleStream {
 public:
  using executor_type = boost::beast::tcp_stream::executor_type;

  /// `tls`: null for plain bytes.
  ConsoleStream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls);

  [[nodiscard]] bool encrypted() const { return tls_ != nullptr; }
  /// Precondition: encrypted.
  void async_handshake(std::function<void(boost::system::error_code)> handler);
  /// What lies below the encryption.
  [[nodiscard]] boost::beast::tcp_stream& tcp() { return tls_ ? tls_->next_layer() : *plain_; }
  void close() { tcp().close(); }

  [[nodiscard]] executor_type get_executor() { return tcp().get_executor(); }
  template <typename Buffers, typename Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    boost::asio::mutable_buffer first;
    for (const boost::asio::mutable_buffer buffer : boost::beast::buffers_range_ref(buffers))
      if (first.size() == 0) first = buffer;
    read_some(first, shared(std::forward<Handler>(handler)));
  }
  template <typename Buffers, typename Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    Pieces pieces;
    for (const boost::asio::const_buffer buffer : boost::beast::buffers_range_ref(buffers))
      if (buffer.size() > 0 && pieces.size() < pieces.capacity()) pieces.push_back(buffer);
    write_some(pieces, shared(std::forward<Handler>(handler)));
  }

 private:
  using Encrypted = boost::asio::ssl::stream<boost::beast::tcp_stream>;
  using Pieces = boost::container::static_vector<boost::asio::const_buffer, 16>;  // written at once at most
  using AfterBytes = std::function<void(boost::system::error_code, size_t)>;

  /// A handler that can only be moved, as one that can be copied.
  template <typename Handler>
  static AfterBytes shared(Handler&& handler) {
    const auto kept = std::make_shared<std::decay_t<Handler>>(std::forward<Handler>(handler));
    return [kept](boost::system::error_code error, size_t bytes) { std::move (*kept)(error, bytes); };
  }
  void read_some(boost::asio::mutable_buffer buffer, AfterBytes handler);
  void write_some(const Pieces& pieces, AfterBytes handler);

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
