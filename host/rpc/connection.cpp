#include "host/rpc/connection.hpp"

#include <fmt/format.h>

namespace diastole {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using std::chrono::steady_clock;

constexpr size_t kept_inbox_bytes = 64U << 10;

}  // namespace

Connection::Connection(std::shared_ptr<RpcState> rpc_state, std::shared_ptr<Connections> all,
                       asio::local::stream_protocol::socket socket)
    : RpcSession(std::move(rpc_state), peer_of(socket.native_handle()), SessionBounds::socket_requests),
      all_(std::move(all)),
      socket_(std::move(socket)) {}

void Connection::read() {
  socket_.async_read_some(asio::buffer(block_), [self = self()](error_code error, size_t bytes) {
    if (error) return self->ended_by_peer();
    self->inbox_.append(self->block_.data(), bytes);
    self->take_more();
  });
}

void Connection::ended_by_peer() {
  if (!socket_.is_open()) return;
  no_more_input_ = true;
  leave();
  close_when_done();
}

void Connection::take_more() {
  while (socket_.is_open() && !no_more_input_ && take_line()) {
  }
}

bool Connection::take_line() {
  if (!may_take()) return false;
  const size_t newline = inbox_.find('\n', searched_);
  if (newline != std::string::npos) {
    const std::string line = inbox_.substr(taken_, newline - taken_);
    taken_ = searched_ = newline + 1;
    line_begun_.reset();
    answer(line);
    return true;
  }
  inbox_.erase(0, std::exchange(taken_, 0));
  searched_ = inbox_.size();
  if (inbox_.empty() && inbox_.capacity() > kept_inbox_bytes) inbox_.shrink_to_fit();
  if (inbox_.size() >= rpc::most_line_bytes) {
    refuse_long_line();
    return false;
  }
  if (!inbox_.empty() && !line_begun_) line_begun_ = steady_clock::now();
  read();
  return false;
}

void Connection::refuse_long_line() {
  rpc_state().log.warn(fmt::format("{} sent a line longer than {} bytes: connection closed", in_words(peer()),
                                   rpc::most_line_bytes));
  const rpc::Error error(rpc::Code::invalid_request,
                         fmt::format("a line has at most {} bytes", rpc::most_line_bytes));
  no_more_input_ = true;
  leave();
  inbox_.clear();
  send(rpc::error_line(nullptr, std::make_exception_ptr(error)));
  close_when_done();
}

void Connection::write(const std::string& message) {
  write_begun_ = steady_clock::now();
  asio::async_write(socket_, asio::buffer(message), [self = self()](error_code error, size_t) {
    self->write_begun_.reset();
    if (error) return self->close();
    self->written();
    if (self->no_more_input_) self->close_when_done();
  });
}

void Connection::close_when_done() {
  if (all_sent() && pending() == 0) close();
}

void Connection::check(Time now) {
  if (line_begun_ && now - *line_begun_ > line_patience) {
    drop(fmt::format("did not end its line within {} s", line_patience.count()));
  } else if (write_begun_ && now - *write_begun_ > SessionBounds::write_patience) {
    drop(fmt::format("has not read for {} s", SessionBounds::write_patience.count()));
  }
}

void Connection::close() {
  if (!socket_.is_open()) return;
  error_code ignored;
  socket_.close(ignored);
  leave();
  all_->erase(number());
}

}  // namespace diastole
