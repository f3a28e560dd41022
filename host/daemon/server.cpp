#include "host/daemon/server.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio.hpp>
#include <deque>
#include <filesystem>
#include <functional>

#include "host/daemon/json_rpc.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace asio = boost::asio;
using asio::local::stream_protocol;
using boost::system::error_code;
using nlohmann::json;

constexpr size_t most_experiment_bytes = 256U << 10;

bool somebody_listens(const std::string& socket) {
  try {
    (void)connect_unix_socket(socket);
    return true;
  } catch (const HardwareError&) {
    return false;
  }
}

ucred peer_of(stream_protocol::socket& socket) {
  ucred peer{};
  socklen_t size = sizeof(peer);
  if (getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    peer.uid = static_cast<uid_t>(-1);
  }
  return peer;
}

}  // namespace

class RpcServer::Listener : public std::enable_shared_from_this<Listener> {
 public:
  class Connection;

  Listener(asio::io_context& context, RigService& rig, std::string path)
      : context_(context), rig_(rig), path_(std::move(path)), acceptor_(context) {
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

  void accept();
  void close() {
    error_code ignored;
    acceptor_.close(ignored);
    ::unlink(path_.c_str());
  }

  asio::io_context& context_;
  RigService& rig_;
  std::string path_;
  stream_protocol::acceptor acceptor_;
  std::weak_ptr<Connection> controlling_;
};

class RpcServer::Listener::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(std::shared_ptr<Listener> listener, stream_protocol::socket socket)
      : listener_(std::move(listener)), socket_(std::move(socket)), peer_(peer_of(socket_)) {}

  void read() {
    asio::async_read_until(socket_, asio::dynamic_buffer(inbox_, rpc::most_line_bytes), '\n',
                           [self = shared_from_this()](error_code error, size_t bytes) {
                             if (error == asio::error::not_found) return self->refuse_long_line();
                             if (error) return;
                             const std::string line = self->inbox_.substr(0, bytes);
                             self->inbox_.erase(0, bytes);
                             self->answer(line);
                             self->read();
                           });
  }

 private:
  void refuse_long_line() {
    const rpc::Error error(rpc::Code::invalid_request,
                           fmt::format("a line has at most {} bytes", rpc::most_line_bytes));
    send(rpc::error_line(nullptr, std::make_exception_ptr(error)));
    closing_ = true;
  }

  void answer(const std::string& line) {
    json id;
    try {
      const rpc::Request request = rpc::parse_request(line, id);
      dispatch(request);
    } catch (...) {
      send(rpc::error_line(id, std::current_exception()));
    }
  }

  void dispatch(const rpc::Request& request) {
    RigService& rig = listener_->rig_;
    if (request.method == "rig.status") return rig.status(reply_to(request.id));
    if (request.method == "run.progress") {
      const size_t first = request.params.value("first_remark", size_t{0});
      return send(rpc::result_line(request.id, rig.run_progress(first)));
    }
    if (request.method == "run.stop") {
      const std::string how = request.params.value("how", "now");
      if (how != "now" && how != "cycle_end") {
        throw rpc::Error(rpc::Code::invalid_params, "how must be \"now\" or \"cycle_end\"");
      }
      const bool stopping = rig.stop(how == "now" ? StopRequest::now : StopRequest::at_cycle_end);
      return send(rpc::result_line(request.id, {{"stopping", stopping}}));
    }
    if (request.method == "control.release") {
      if (listener_->controlling_.lock().get() == this) listener_->controlling_.reset();
      return send(rpc::result_line(request.id, json::object()));
    }
    if (request.method == "run.start") {
      const std::string text = request.params.at("experiment");
      if (text.size() > most_experiment_bytes) {
        throw rpc::Error(rpc::Code::invalid_params, "the experiment is too long");
      }
      Experiment experiment = parse_experiment(text, request.params.value("file", "experiment"));
      return control([&] { rig.start_run(std::move(experiment), reply_to(request.id)); });
    }
    if (request.method == "rig.home") {
      return control([&] { rig.home(reply_to(request.id)); });
    }
    if (request.method == "rig.clear_fault") {
      return control([&] { rig.clear_fault(reply_to(request.id)); });
    }
    throw rpc::Error(rpc::Code::method_not_found, "there is no method " + request.method);
  }

  /// Gives an order; who may and whose order was accepted holds the control from then on.
  void control(const std::function<void()>& order) {
    if (peer_.uid != 0 && peer_.uid != getuid()) {
      throw rpc::Error(rpc::Code::not_allowed,
                       fmt::format("user {} may observe and stop, but not control this rig", peer_.uid));
    }
    const auto holder = listener_->controlling_.lock();
    if (holder && holder.get() != this) {
      throw rpc::Error(rpc::Code::control_held,
                       fmt::format("the rig is controlled by process {}", holder->peer_.pid),
                       {{"holder", holder->peer_.pid}});
    }
    order();
    listener_->controlling_ = weak_from_this();
  }

  /// Brings an answer from the rig's thread to this connection's.
  RigService::Done reply_to(const json& id) {
    return [weak = weak_from_this(), &context = listener_->context_, id](const std::exception_ptr& error,
                                                                         const json& result) {
      const std::string line = error ? rpc::error_line(id, error) : rpc::result_line(id, result);
      asio::post(context, [weak, line] {
        if (const auto self = weak.lock()) self->send(line);
      });
    };
  }

  void send(const std::string& line) {
    if (closing_) return;
    outbox_bytes_ += line.size();
    if (outbox_bytes_ > rpc::most_line_bytes) {
      spdlog::warn("process {} does not read its answers: connection closed", peer_.pid);
      error_code ignored;
      socket_.close(ignored);
      return;
    }
    outbox_.push_back(line);
    if (outbox_.size() == 1) write();
  }

  void write() {
    asio::async_write(socket_, asio::buffer(outbox_.front()),
                      [self = shared_from_this()](error_code error, size_t) {
                        if (error) return;
                        self->outbox_bytes_ -= self->outbox_.front().size();
                        self->outbox_.pop_front();
                        if (!self->outbox_.empty()) return self->write();
                        if (self->closing_) self->socket_.close(error);
                      });
  }

  std::shared_ptr<Listener> listener_;
  stream_protocol::socket socket_;
  ucred peer_;
  std::string inbox_;
  std::deque<std::string> outbox_;
  size_t outbox_bytes_ = 0;
  bool closing_ = false;
};

void RpcServer::Listener::accept() {
  acceptor_.async_accept([self = shared_from_this()](error_code error, stream_protocol::socket socket) {
    if (error) return;
    std::make_shared<Connection>(self, std::move(socket))->read();
    self->accept();
  });
}

RpcServer::RpcServer(asio::io_context& context, RigService& rig, const std::string& socket)
    : listener_(std::make_shared<Listener>(context, rig, socket)) {
  listener_->accept();
}

RpcServer::~RpcServer() { listener_->close(); }

}  // namespace diastole
