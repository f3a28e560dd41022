#include "host/rpc/server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>

#include "host/rpc/acceptor.hpp"
#include "host/rpc/peer.hpp"
#include "host/rpc/rpc_session.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace asio = boost::asio;
using asio::local::stream_protocol;
using boost::system::error_code;
using std::chrono::steady_clock;
using namespace std::chrono_literals;

bool is_listening(const std::string& socket) {
  try {
    (void)connect_unix_socket(socket);
    return true;
  } catch (const HardwareError&) {
    return false;
  }
}

}  // namespace

class Connection;
using Connections = std::map<uint64_t, std::shared_ptr<Connection>>;

/// One client of the daemon's socket: lines to and fro. It can cost the rig nothing: what it sends, what waits for it
/// and how long are bounded, and whoever goes beyond a bound is answered or dropped, and logged.
class Connection : public RpcSession {
 public:
  /// For the rest of a line that was begun.
  static constexpr std::chrono::seconds line_timeout{10};

  /// Removes itself from `all` when it closes.
  Connection(std::shared_ptr<RpcState> rpc_state, std::shared_ptr<Connections> all,
             stream_protocol::socket socket)
      : RpcSession(std::move(rpc_state), peer_of(socket.native_handle()), SessionBounds::socket_requests),
        all_(std::move(all)),
        socket_(std::move(socket)) {}

  void read() {
    socket_.async_read_some(asio::buffer(block_), [self = self()](error_code error, size_t bytes) {
      if (error) return self->ended_by_peer();
      self->inbox_.append(self->block_.data(), bytes);
      self->take_more();
    });
  }
  /// Drops the connection if a half line or an unread answer has waited too long.
  void check(Time now) {
    if (line_begun_ && now - *line_begun_ > line_timeout) {
      drop(fmt::format("did not end its line within {} s", line_timeout.count()));
    } else if (write_begun_ && now - *write_begun_ > SessionBounds::write_timeout) {
      drop(fmt::format("has not read for {} s", SessionBounds::write_timeout.count()));
    }
  }
  void close() override {
    if (!socket_.is_open()) return;
    error_code ignored;
    socket_.close(ignored);
    leave();
    all_->erase(number());
  }

 private:
  static constexpr size_t kept_inbox_bytes = 64U << 10;

  std::shared_ptr<Connection> self() { return std::static_pointer_cast<Connection>(shared_from_this()); }
  void take_more() override {
    while (socket_.is_open() && !no_more_input_ && take_line()) {
    }
  }
  /// Answers the next line; false if none has come whole, or none may be taken now.
  bool take_line() {
    if (!may_take()) return false;
    const size_t newline = inbox_.find('\n', searched_);
    if (newline != std::string::npos) {
      const std::string line = inbox_.substr(consumed_, newline - consumed_);
      consumed_ = searched_ = newline + 1;
      line_begun_.reset();
      answer(line);
      return true;
    }
    inbox_.erase(0, std::exchange(consumed_, 0));
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
  void ended_by_peer() {
    if (!socket_.is_open()) return;
    no_more_input_ = true;
    leave();
    close_when_done();
  }
  void refuse_long_line() {
    rpc_state().log.warn(fmt::format("{} sent a line longer than {} bytes: connection closed",
                                     in_words(peer()), rpc::most_line_bytes));
    const rpc::Error error(rpc::Code::invalid_request,
                           fmt::format("a line has at most {} bytes", rpc::most_line_bytes));
    no_more_input_ = true;
    leave();
    inbox_.clear();
    send(rpc::error_line(nullptr, std::make_exception_ptr(error)));
    close_when_done();
  }
  void write(const std::string& line) override {
    write_begun_ = steady_clock::now();
    asio::async_write(socket_, asio::buffer(line), [self = self()](error_code error, size_t) {
      self->write_begun_.reset();
      if (error) return self->close();
      self->written();
      if (self->no_more_input_) self->close_when_done();
    });
  }
  [[nodiscard]] bool is_open() const override { return socket_.is_open(); }
  void close_when_done() {
    if (all_sent() && pending() == 0) close();
  }

  std::shared_ptr<Connections> all_;
  stream_protocol::socket socket_;
  std::array<char, 16384> block_{};
  std::string inbox_;
  size_t consumed_ = 0;  // bytes of inbox_ that are answered
  size_t searched_ = 0;  // bytes of inbox_ that hold no newline
  bool no_more_input_ = false;
  std::optional<Time> line_begun_;
  std::optional<Time> write_begun_;
};

class RpcServer::Listener : public std::enable_shared_from_this<Listener> {
 public:
  Listener(const std::shared_ptr<RpcState>& rpc_state, std::string path)
      : path_(std::move(path)),
        acceptor_(std::make_shared<Acceptor<stream_protocol>>(
            rpc_state, "a connection",
            [this, rpc_state](stream_protocol::socket socket) { take(rpc_state, std::move(socket)); })),
        sweep_(rpc_state->context) {
    expect_own_place(path_);
    if (std::filesystem::exists(path_) && is_listening(path_)) {
      throw HardwareError(path_, "another daemon listens at this socket",
                          "Stop it, or choose another `socket` in [daemon].");
    }
    std::error_code ignored;
    if (std::filesystem::is_socket(path_, ignored)) std::filesystem::remove(path_, ignored);
    try {
      const stream_protocol::endpoint endpoint(path_);
      acceptor_->acceptor.open(endpoint.protocol());
      acceptor_->acceptor.bind(endpoint);
      std::filesystem::permissions(path_, std::filesystem::perms::all);  // the peers' user ids decide
      acceptor_->acceptor.listen();
    } catch (const std::exception& error) {
      throw HardwareError(path_, fmt::format("the socket cannot be made: {}", error.what()),
                          "Check the directory and the length of the path (107 bytes at most).");
    }
  }

  void begin() {
    acceptor_->accept();
    sweep();
  }

  void close() {
    acceptor_->close();
    sweep_.cancel();
    ::unlink(path_.c_str());
    for (const auto& [number, connection] : std::exchange(*connections_, {}))
      connection->close();
  }

 private:
  void take(const std::shared_ptr<RpcState>& rpc_state, stream_protocol::socket socket) {
    evict_if_full();
    const auto connection = std::make_shared<Connection>(rpc_state, connections_, std::move(socket));
    connections_->emplace(connection->number(), connection);
    connection->read();
  }

  void evict_if_full() {
    const auto& all = *connections_;
    if (all.size() < most_connections) return;
    const auto rank = [](const auto& entry) {
      return std::pair(entry.second->controls(), entry.second->last_request());
    };
    const auto connection = std::ranges::min_element(all, {}, rank)->second;
    connection->drop(fmt::format("is silent and {} others wait", most_connections));
  }

  void sweep() {
    sweep_.expires_after(1s);
    sweep_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (cancelled) return;
      const Connections all = *self->connections_;
      for (const auto& [number, connection] : all)
        connection->check(std::chrono::steady_clock::now());
      self->sweep();
    });
  }

  std::shared_ptr<Connections> connections_ = std::make_shared<Connections>();
  std::string path_;
  std::shared_ptr<Acceptor<stream_protocol>> acceptor_;
  asio::steady_timer sweep_;
};

RpcServer::RpcServer(std::shared_ptr<RpcState> rpc_state, const std::string& socket)
    : listener_(std::make_shared<Listener>(rpc_state, socket)) {
  listener_->begin();
}

RpcServer::~RpcServer() { listener_->close(); }

}  // namespace diastole
