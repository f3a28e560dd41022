#include "host/daemon/server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <vector>

#include "host/daemon/connection.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace asio = boost::asio;
using asio::local::stream_protocol;
using boost::system::error_code;
using namespace std::chrono_literals;

bool somebody_listens(const std::string& socket) {
  try {
    (void)connect_unix_socket(socket);
    return true;
  } catch (const HardwareError&) {
    return false;
  }
}

}  // namespace

class RpcServer::Listener : public std::enable_shared_from_this<Listener> {
 public:
  Listener(std::shared_ptr<Reception> reception, std::string path)
      : reception_(std::move(reception)),
        path_(std::move(path)),
        acceptor_(reception_->context),
        pause_(reception_->context),
        sweep_(reception_->context) {
    if (std::filesystem::exists(path_) && somebody_listens(path_)) {
      throw HardwareError(path_, "another daemon listens at this socket",
                          "Stop it, or choose another `socket` in [daemon].");
    }
    std::error_code ignored;
    if (std::filesystem::is_socket(path_, ignored)) std::filesystem::remove(path_, ignored);
    try {
      const stream_protocol::endpoint endpoint(path_);
      acceptor_.open(endpoint.protocol());
      acceptor_.bind(endpoint);
      std::filesystem::permissions(path_, std::filesystem::perms::all);  // the peers' user ids decide
      acceptor_.listen();
    } catch (const std::exception& error) {
      throw HardwareError(path_, fmt::format("the socket cannot be made: {}", error.what()),
                          "Check the directory and the length of the path (107 bytes at most).");
    }
  }

  void begin() {
    accept();
    sweep();
  }

  void close() {
    error_code ignored;
    acceptor_.close(ignored);
    pause_.cancel();
    sweep_.cancel();
    ::unlink(path_.c_str());
    for (const auto& [number, connection] : std::exchange(*connections_, {}))
      connection->close();
  }

 private:
  void accept() {
    acceptor_.async_accept([self = shared_from_this()](error_code error, stream_protocol::socket socket) {
      if (error == asio::error::operation_aborted || !self->acceptor_.is_open()) return;
      if (error) return self->accept_later(error);
      self->make_room();
      const auto connection =
          std::make_shared<Connection>(self->reception_, self->connections_, std::move(socket));
      self->connections_->emplace(connection->number(), connection);
      connection->read();
      self->accept();
    });
  }

  /// For want of descriptors or memory; those in use come back.
  void accept_later(error_code error) {
    reception_->log.warn("a connection could not be accepted: " + error.message());
    pause_.expires_after(100ms);
    pause_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled) self->accept();
    });
  }

  void make_room() {
    const auto& all = *connections_;
    if (all.size() < most_connections) return;
    const auto rank = [](const auto& entry) {
      return std::pair(entry.second->controls(), entry.second->last_request());
    };
    const auto idlest = std::min_element(all.begin(), all.end(),
                                         [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
    const auto connection = idlest->second;
    connection->drop(fmt::format("is silent and {} others wait", most_connections));
  }

  void sweep() {
    sweep_.expires_after(1s);
    sweep_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (cancelled) return;
      std::vector<std::shared_ptr<Connection>> all;
      for (const auto& [number, connection] : *self->connections_)
        all.push_back(connection);
      for (const auto& connection : all)
        connection->check(std::chrono::steady_clock::now());
      self->sweep();
    });
  }

  std::shared_ptr<Reception> reception_;
  std::shared_ptr<Connections> connections_ = std::make_shared<Connections>();
  std::string path_;
  stream_protocol::acceptor acceptor_;
  asio::steady_timer pause_;
  asio::steady_timer sweep_;
};

RpcServer::RpcServer(std::shared_ptr<Reception> reception, const std::string& socket)
    : listener_(std::make_shared<Listener>(std::move(reception), socket)) {
  listener_->begin();
}

RpcServer::~RpcServer() { listener_->close(); }

}  // namespace diastole
