#include "host/rpc/server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "host/rpc/acceptor.hpp"
#include "host/rpc/connection.hpp"
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
  Listener(const std::shared_ptr<RpcState>& rpc_state, std::string path)
      : path_(std::move(path)),
        acceptor_(std::make_shared<Acceptor<stream_protocol>>(
            rpc_state, "a connection",
            [this, rpc_state](stream_protocol::socket socket) { take(rpc_state, std::move(socket)); })),
        sweep_(rpc_state->context) {
    if (std::filesystem::exists(path_) && somebody_listens(path_)) {
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
    make_room();
    const auto connection = std::make_shared<Connection>(rpc_state, connections_, std::move(socket));
    connections_->emplace(connection->number(), connection);
    connection->read();
  }

  void make_room() {
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
