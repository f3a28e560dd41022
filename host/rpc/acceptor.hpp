#pragma once
// Takes in connections, one after the other, for as long as it is open. When there are no descriptors or no memory left
// for one, it waits a little: those in use come back.

#include <utility>  // before Asio, which uses std::exchange without it

#include <boost/asio.hpp>
#include <chrono>
#include <functional>
#include <memory>

#include "host/rpc/rpc_session.hpp"

namespace diastole {

template <typename Protocol>
class Acceptor : public std::enable_shared_from_this<Acceptor<Protocol>> {
 public:
  using Socket = typename Protocol::socket;

  /// `who` may not be accepted, for the log: "a browser". Whoever owns this opens and binds `acceptor`.
  Acceptor(std::shared_ptr<RpcState> rpc_state, std::string who, std::function<void(Socket)> take)
      : acceptor(rpc_state->context),
        rpc_(std::move(rpc_state)),
        who_(std::move(who)),
        take_(std::move(take)),
        pause_(rpc_->context) {}

  void accept() {
    acceptor.async_accept([self = this->shared_from_this()](boost::system::error_code error, Socket socket) {
      if (error == boost::asio::error::operation_aborted || !self->acceptor.is_open()) return;
      if (error) return self->accept_later(error);
      self->take_(std::move(socket));
      self->accept();
    });
  }

  void close() {
    boost::system::error_code ignored;
    acceptor.close(ignored);
    pause_.cancel();
  }

  typename Protocol::acceptor acceptor;

 private:
  void accept_later(boost::system::error_code error) {
    rpc_->log.warn(who_ + " could not be accepted: " + error.message());
    pause_.expires_after(std::chrono::milliseconds(100));
    pause_.async_wait([self = this->shared_from_this()](boost::system::error_code cancelled) {
      if (!cancelled) self->accept();
    });
  }

  std::shared_ptr<RpcState> rpc_;
  std::string who_;
  std::function<void(Socket)> take_;
  boost::asio::steady_timer pause_;
};

}  // namespace diastole
