#pragma once
// One client of the daemon, whichever way it came: the unix socket (server.cpp) or the web console
// (host/web). Here stand the rules that hold for all: who may give orders, the one control lease, how many requests
// a second are taken and how many may wait for the rig. A connection only carries messages to and fro.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>  // before Asio, which uses std::exchange without it

#include <algorithm>
#include <boost/asio.hpp>
#include <chrono>
#include <deque>
#include <memory>
#include <string>
#include <string_view>

#include "host/rpc/control_lease.hpp"
#include "host/rpc/json_rpc.hpp"
#include "host/rpc/methods.hpp"
#include "host/rpc/peer.hpp"

namespace diastole {

/// Remarks that clients can provoke at will, and that must not fill the log: a few a second are written, of the
/// others their number.
class QuietLog {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void warn(const std::string& text, Time now = std::chrono::steady_clock::now()) {
    if (now - second_began_ >= std::chrono::seconds(1)) {
      if (left_out_ > 0) spdlog::warn("{} more remarks like the last ones were left out", left_out_);
      second_began_ = now;
      written_ = left_out_ = 0;
    }
    if (written_ < most_a_second) {
      ++written_;
      spdlog::warn("{}", text);
    } else {
      ++left_out_;
    }
  }

 private:
  static constexpr int most_a_second = 5;
  Time second_began_{};
  int written_ = 0;
  int left_out_ = 0;
};

/// What all clients share; used on the server's thread only.
struct RpcState {
  boost::asio::io_context& context;
  Rig& rig;
  ControlPolicy policy;
  ControlLease lease{};
  QuietLog log{};
  uint64_t last_number = 0;
  nlohmann::json console = nullptr;  ///< the answer to console.address
};

/// Bounds of one client.
struct SessionBounds {
  static constexpr size_t most_unread_bytes = 256U << 10;  ///< answers that the client has not read
  static constexpr int most_pending = 8;                   ///< requests that wait for the rig
  static constexpr int socket_requests = 50;   ///< in a window; beyond it reading pauses until the next
  static constexpr int console_requests = 10;  ///< likewise; a page asks for a quarter of that
  static constexpr std::chrono::milliseconds window{100};
  static constexpr std::chrono::seconds write_timeout{10};  ///< for a client that does not read
};

class RpcSession : public std::enable_shared_from_this<RpcSession> {
 public:
  using Time = std::chrono::steady_clock::time_point;

  virtual ~RpcSession() = default;
  RpcSession(const RpcSession&) = delete;
  RpcSession& operator=(const RpcSession&) = delete;

  [[nodiscard]] uint64_t number() const { return number_; }
  [[nodiscard]] const Peer& peer() const { return peer_; }
  [[nodiscard]] Time last_request() const { return last_request_; }
  [[nodiscard]] bool controls() const {
    const auto& holder = rpc_->lease.holder();
    return holder && holder->connection == number_;
  }
  /// Closes at once; the log says why.
  void drop(const std::string& why) {
    rpc_->log.warn(fmt::format("{} {}: connection closed", in_words(peer_), why));
    close();
  }
  virtual void close() = 0;

 protected:
  /// `requests_in_window`: of SessionBounds.
  RpcSession(std::shared_ptr<RpcState> rpc_state, Peer peer, int requests_in_window)
      : number_(++rpc_state->last_number),
        rpc_(std::move(rpc_state)),
        peer_(std::move(peer)),
        resume_(rpc_->context),
        requests_in_window_(requests_in_window),
        requests_left_(requests_in_window),
        last_request_(std::chrono::steady_clock::now()) {}

  /// Whether a request may be taken now; if not, take_more() is called when one may.
  [[nodiscard]] bool may_take() {
    const auto now = std::chrono::steady_clock::now();
    if (now - window_began_ >= SessionBounds::window) {
      window_began_ = now;
      requests_left_ = requests_in_window_;
    }
    if (pending_ >= SessionBounds::most_pending) {
      waiting_ = true;
      return false;
    }
    if (requests_left_ > 0) return true;
    resume_.expires_at(window_began_ + SessionBounds::window);
    resume_.async_wait([self = shared_from_this()](boost::system::error_code error) {
      if (!error) self->take_more();
    });
    return false;
  }
  /// Carries out one request; the answer comes through send(), now or later.
  void answer(std::string_view request) {
    --requests_left_;
    last_request_ = std::chrono::steady_clock::now();
    nlohmann::json id;
    try {
      dispatch(rpc::parse_request(request, id));
    } catch (...) {
      send(rpc::error_line(id, std::current_exception()));
    }
  }
  /// The client is gone: it controls nothing any more.
  void leave() {
    resume_.cancel();
    rpc_->lease.release(number_);
  }
  [[nodiscard]] int pending() const { return pending_; }
  [[nodiscard]] RpcState& rpc_state() const { return *rpc_; }
  /// Sends a message after those that wait; drops a client that does not read them.
  void send(std::string message) {
    if (!is_open()) return;
    outbox_bytes_ += message.size();
    const size_t most = SessionBounds::most_unread_bytes;
    if (outbox_bytes_ > most + rpc::most_line_bytes || (outbox_.size() > 1 && outbox_bytes_ > most))
      return drop("does not read its answers");
    outbox_.push_back(std::move(message));
    if (outbox_.size() == 1) write(outbox_.front());
  }
  /// The message that write() was called with is out.
  void written() {
    outbox_bytes_ -= outbox_.front().size();
    outbox_.pop_front();
    if (!outbox_.empty()) write(outbox_.front());
  }
  [[nodiscard]] bool all_sent() const { return outbox_.empty(); }

  [[nodiscard]] virtual bool is_open() const = 0;
  /// `message` stays as it is until written() is called.
  virtual void write(const std::string& message) = 0;
  virtual void take_more() = 0;

 private:
  static constexpr size_t most_name_bytes = 40;

  /// As it will stand in the log and in the run's events.
  static void check_name(const std::string& name) {
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
    if (name.empty() || name.size() > most_name_bytes || name.front() == ' ' || name.back() == ' ' ||
        std::any_of(name.begin(), name.end(), is_control)) {
      throw rpc::Error(rpc::Code::invalid_params,
                       fmt::format("name must be 1 to {} bytes, without blanks around it", most_name_bytes));
    }
  }

  void dispatch(const rpc::Request& request) {
    if (dispatch_own(request)) return;
    const Method* method = find_method(request.method);
    if (method == nullptr) {
      throw rpc::Error(rpc::Code::method_not_found, "there is no method " + request.method);
    }
    const bool held = controls();
    if (method->access == Access::controller) {
      require_permission();
      rpc_->lease.claim(number_, peer_);
    }
    try {
      method->act(rpc_->rig, request.params, reply_to(request.id, request.method == "rig.status"));
    } catch (...) {
      --pending_;
      if (!held) rpc_->lease.release(number_);  // an order that was refused holds nothing
      throw;
    }
  }
  /// Requests about the client itself; false if it is none.
  bool dispatch_own(const rpc::Request& request) {
    if (request.method == "control.take") {
      take_control(request);
    } else if (request.method == "control.release") {
      rpc_->lease.release(number_);
      send(rpc::result_line(request.id, nlohmann::json::object()));
    } else if (request.method == "console.sign_in") {
      sign_in(request);
    } else if (request.method == "console.address") {
      if (!peer_.console.empty() || !rpc_->policy.may_control(peer_)) {
        throw rpc::Error(
            rpc::Code::not_allowed,
            "the address holds the token: it is told to users at the socket who may control the rig");
      }
      send(rpc::result_line(request.id, rpc_->console));
    } else {
      return false;
    }
    return true;
  }
  void take_control(const rpc::Request& request) {
    require_permission();
    ControlLease& lease = rpc_->lease;
    if (request.params.contains("take_over")) {
      const std::string named = request.params.at("take_over");
      if (const auto before = lease.take_over(number_, peer_, named)) {
        rpc_->rig.note(
            {"warning", "control_taken_over",
             fmt::format("control was taken over from {} by {}", in_words(*before), in_words(peer_))});
      }
    } else {
      lease.claim(number_, peer_);
    }
    send(rpc::result_line(request.id, control()));
  }
  void sign_in(const rpc::Request& request) {
    if (peer_.console.empty()) {
      throw rpc::Error(rpc::Code::not_allowed, "the kernel says who is at the socket; only consoles sign in");
    }
    const std::string name = request.params.at("name");
    check_name(name);
    if (controls() && name != peer_.user) {
      throw rpc::Error(rpc::Code::not_allowed, "release the control before somebody else signs in here");
    }
    peer_.user = name;
    send(rpc::result_line(request.id, as_json(peer_)));
  }
  void require_permission() const {
    if (!rpc_->policy.may_control(peer_)) {
      throw rpc::Error(rpc::Code::not_allowed,
                       peer_.console.empty()
                           ? fmt::format("user {} may observe and stop, but not control this rig", peer_.user)
                           : "this console's address is for observing and stopping, not for control");
    }
    if (peer_.user.empty()) {
      throw rpc::Error(rpc::Code::not_allowed, "say who you are before you give orders (console.sign_in)");
    }
  }
  nlohmann::json control() const {
    const auto& holder = rpc_->lease.holder();
    if (!holder) return nullptr;
    nlohmann::json object = as_json(holder->peer);
    object["own"] = holder->connection == number_;
    return object;
  }
  /// Brings an answer from the rig's thread to the server's.
  Reply reply_to(const nlohmann::json& id, bool with_control) {
    ++pending_;
    return [weak = weak_from_this(), &context = rpc_->context, id, with_control](
               const std::exception_ptr& error, const nlohmann::json& result) {
      boost::asio::post(context, [weak, id, with_control, error, result] {
        if (const auto self = weak.lock()) self->deliver(id, with_control, error, result);
      });
    };
  }
  void deliver(const nlohmann::json& id, bool with_control, const std::exception_ptr& error,
               nlohmann::json result) {
    --pending_;
    if (with_control && !error) result["control"] = control();
    send(error ? rpc::error_line(id, error) : rpc::result_line(id, result));
    if (std::exchange(waiting_, false)) take_more();
  }

  uint64_t number_;
  std::shared_ptr<RpcState> rpc_;
  Peer peer_;
  boost::asio::steady_timer resume_;
  Time window_began_{};
  int requests_in_window_;
  int requests_left_;
  int pending_ = 0;
  std::deque<std::string> outbox_;
  size_t outbox_bytes_ = 0;
  bool waiting_ = false;  // reading pauses until the rig has answered
  Time last_request_;
};

}  // namespace diastole
