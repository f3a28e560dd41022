#include "host/rpc/rpc_session.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/rpc/methods.hpp"

namespace diastole {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using nlohmann::json;
using std::chrono::steady_clock;

constexpr size_t most_name_bytes = 40;

/// As it will stand in the log and in the run's events.
void check_name(const std::string& name) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  if (name.empty() || name.size() > most_name_bytes || name.front() == ' ' || name.back() == ' ' ||
      std::any_of(name.begin(), name.end(), is_control)) {
    throw rpc::Error(rpc::Code::invalid_params,
                     fmt::format("name must be 1 to {} bytes, without blanks around it", most_name_bytes));
  }
}

}  // namespace

RpcSession::RpcSession(std::shared_ptr<RpcState> rpc_state, Peer peer, int requests_in_window)
    : number_(++rpc_state->last_number),
      rpc_(std::move(rpc_state)),
      peer_(std::move(peer)),
      resume_(rpc_->context),
      requests_in_window_(requests_in_window),
      requests_left_(requests_in_window),
      last_request_(steady_clock::now()) {}

bool RpcSession::controls() const {
  const auto& holder = rpc_->lease.holder();
  return holder && holder->connection == number_;
}

void RpcSession::leave() {
  resume_.cancel();
  rpc_->lease.release(number_);
}

void RpcSession::drop(const std::string& why) {
  rpc_->log.warn(fmt::format("{} {}: connection closed", in_words(peer_), why));
  close();
}

void RpcSession::send(std::string message) {
  if (!is_open()) return;
  outbox_bytes_ += message.size();
  const size_t most = SessionBounds::most_unread_bytes;
  if (outbox_bytes_ > most + rpc::most_line_bytes || (outbox_.size() > 1 && outbox_bytes_ > most))
    return drop("does not read its answers");
  outbox_.push_back(std::move(message));
  if (outbox_.size() == 1) write(outbox_.front());
}

void RpcSession::written() {
  outbox_bytes_ -= outbox_.front().size();
  outbox_.pop_front();
  if (!outbox_.empty()) write(outbox_.front());
}

bool RpcSession::may_take() {
  const auto now = steady_clock::now();
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
  resume_.async_wait([self = shared_from_this()](error_code error) {
    if (!error) self->take_more();
  });
  return false;
}

void RpcSession::answer(std::string_view request) {
  --requests_left_;
  last_request_ = steady_clock::now();
  json id;
  try {
    dispatch(rpc::parse_request(request, id));
  } catch (...) {
    send(rpc::error_line(id, std::current_exception()));
  }
}

void RpcSession::dispatch(const rpc::Request& request) {
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

bool RpcSession::dispatch_own(const rpc::Request& request) {
  if (request.method == "control.take") {
    take_control(request);
  } else if (request.method == "control.release") {
    rpc_->lease.release(number_);
    send(rpc::result_line(request.id, json::object()));
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

void RpcSession::take_control(const rpc::Request& request) {
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

void RpcSession::sign_in(const rpc::Request& request) {
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

void RpcSession::require_permission() const {
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

json RpcSession::control() const {
  const auto& holder = rpc_->lease.holder();
  if (!holder) return nullptr;
  json object = as_json(holder->peer);
  object["own"] = holder->connection == number_;
  return object;
}

Reply RpcSession::reply_to(const json& id, bool with_control) {
  ++pending_;
  return [weak = weak_from_this(), &context = rpc_->context, id, with_control](
             const std::exception_ptr& error, const json& result) {
    asio::post(context, [weak, id, with_control, error, result] {
      if (const auto self = weak.lock()) self->deliver(id, with_control, error, result);
    });
  };
}

void RpcSession::deliver(const json& id, bool with_control, const std::exception_ptr& error, json result) {
  --pending_;
  if (with_control && !error) result["control"] = control();
  send(error ? rpc::error_line(id, error) : rpc::result_line(id, result));
  if (std::exchange(waiting_, false)) take_more();
}

}  // namespace diastole
