#include "host/web/console_stream.hpp"

namespace diastole::web {

ConsoleStream::ConsoleStream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls)
    : plain_(tls == nullptr ? std::make_unique<boost::beast::tcp_stream>(std::move(socket)) : nullptr),
      tls_(tls == nullptr ? nullptr : std::make_unique<Encrypted>(std::move(socket), *tls)) {}

void ConsoleStream::async_handshake(std::function<void(boost::system::error_code)> handler) {
  tls_->async_handshake(boost::asio::ssl::stream_base::server, std::move(handler));
}

void ConsoleStream::read_some(boost::asio::mutable_buffer buffer, AfterBytes handler) {
  if (tls_) return tls_->async_read_some(buffer, std::move(handler));
  plain_->async_read_some(buffer, std::move(handler));
}

void ConsoleStream::write_some(const Pieces& pieces, AfterBytes handler) {
  if (tls_) return tls_->async_write_some(pieces, std::move(handler));
  plain_->async_write_some(pieces, std::move(handler));
}

}  // namespace diastole::web
