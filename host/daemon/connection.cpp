#include "host/daemon/connection.hpp"

#include <fmt/format.h>

#include <utility>

#include "host/daemon/methods.hpp"

namespace diastole {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using nlohmann::json;
using std::chrono::steady_clock;

constexpr size_t kept_inbox_bytes = 64U << 10;

}  // namespace

Connection::Connection(uint64_t number, std::shared_ptr<Reception> reception,
                       asio::local::stream_protocol::socket socket)
    : number_(number),
      reception_(std::move(reception)),
      socket_(std::move(socket)),
      resume_(reception_->context),
      peer_(peer_of(socket_.native_handle())),
      last_line_(steady_clock::now()) {}

bool Connection::controls() const {
  const auto& holder = reception_->lease.holder();
  return holder && holder->connection == number_;
}

void Connection::read() {
  socket_.async_read_some(asio::buffer(block_), [self = shared_from_this()](error_code error, size_t bytes) {
    if (error) return self->ended_by_peer();
    self->inbox_.append(self->block_.data(), bytes);
    self->take_lines();
  });
}

void Connection::ended_by_peer() {
  if (!socket_.is_open()) return;
  no_more_input_ = true;
  reception_->lease.release(number_);
  close_when_done();
}

void Connection::take_lines() {
  while (socket_.is_open() && !no_more_input_ && take_line()) {
  }
}

bool Connection::take_line() {
  const auto now = steady_clock::now();
  if (now - window_began_ >= ConnectionBounds::window) {
    window_began_ = now;
    lines_left_ = ConnectionBounds::lines_in_window;
  }
  if (pending_ >= ConnectionBounds::most_pending) {
    waiting_ = true;
    return false;
  }
  if (lines_left_ == 0) {
    resume_.expires_at(window_began_ + ConnectionBounds::window);
    resume_.async_wait([self = shared_from_this()](error_code error) {
      if (!error) self->take_lines();
    });
    return false;
  }
  const size_t newline = inbox_.find('\n', searched_);
  if (newline != std::string::npos) {
    --lines_left_;
    const std::string line = inbox_.substr(taken_, newline - taken_);
    taken_ = searched_ = newline + 1;
    last_line_ = now;
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
  if (!inbox_.empty() && !line_begun_) line_begun_ = now;
  read();
  return false;
}

void Connection::refuse_long_line() {
  reception_->log.warn(fmt::format("{} sent a line longer than {} bytes: connection closed", in_words(peer_),
                                   rpc::most_line_bytes));
  const rpc::Error error(rpc::Code::invalid_request,
                         fmt::format("a line has at most {} bytes", rpc::most_line_bytes));
  no_more_input_ = true;
  reception_->lease.release(number_);
  inbox_.clear();
  send(rpc::error_line(nullptr, std::make_exception_ptr(error)));
  close_when_done();
}

void Connection::answer(std::string_view line) {
  json id;
  try {
    dispatch(rpc::parse_request(line, id));
  } catch (...) {
    send(rpc::error_line(id, std::current_exception()));
  }
}

void Connection::dispatch(const rpc::Request& request) {
  if (request.method == "control.take") return take_control(request);
  if (request.method == "control.release") {
    reception_->lease.release(number_);
    return send(rpc::result_line(request.id, json::object()));
  }
  const Method* method = find_method(request.method);
  if (method == nullptr) {
    throw rpc::Error(rpc::Code::method_not_found, "there is no method " + request.method);
  }
  const bool held = controls();
  if (method->access == Access::controller) {
    require_permission();
    reception_->lease.claim(number_, peer_);
  }
  try {
    method->act(reception_->rig, request.params, reply_to(request.id, request.method == "rig.status"));
  } catch (...) {
    --pending_;
    if (!held) reception_->lease.release(number_);  // an order that was refused holds nothing
    throw;
  }
}

void Connection::take_control(const rpc::Request& request) {
  require_permission();
  ControlLease& lease = reception_->lease;
  if (request.params.contains("take_over")) {
    const std::string named = request.params.at("take_over");
    if (const auto before = lease.take_over(number_, peer_, named)) {
      reception_->rig.note(
          {"warning", "control_taken_over",
           fmt::format("control was taken over from {} by {}", in_words(*before), in_words(peer_))});
    }
  } else {
    lease.claim(number_, peer_);
  }
  send(rpc::result_line(request.id, control()));
}

void Connection::require_permission() const {
  if (reception_->policy.may_control(peer_)) return;
  throw rpc::Error(rpc::Code::not_allowed,
                   fmt::format("user {} may observe and stop, but not control this rig", peer_.user));
}

json Connection::control() const {
  const auto& holder = reception_->lease.holder();
  if (!holder) return nullptr;
  return {{"user", holder->peer.user}, {"uid", holder->peer.uid}, {"pid", holder->peer.pid}};
}

RigService::Done Connection::reply_to(const json& id, bool with_control) {
  ++pending_;
  return [weak = weak_from_this(), &context = reception_->context, id, with_control](
             const std::exception_ptr& error, const json& result) {
    asio::post(context, [weak, id, with_control, error, result] {
      if (const auto self = weak.lock()) self->deliver(id, with_control, error, result);
    });
  };
}

void Connection::deliver(const json& id, bool with_control, const std::exception_ptr& error, json result) {
  --pending_;
  if (with_control && !error) result["control"] = control();
  send(error ? rpc::error_line(id, error) : rpc::result_line(id, result));
  if (std::exchange(waiting_, false)) take_lines();
}

void Connection::send(std::string line) {
  if (!socket_.is_open()) return;
  outbox_bytes_ += line.size();
  if (outbox_bytes_ > ConnectionBounds::most_unread_bytes + rpc::most_line_bytes ||
      (outbox_.size() > 1 && outbox_bytes_ > ConnectionBounds::most_unread_bytes)) {
    return drop("does not read its answers");
  }
  outbox_.push_back(std::move(line));
  if (outbox_.size() == 1) write();
}

void Connection::write() {
  write_begun_ = steady_clock::now();
  asio::async_write(socket_, asio::buffer(outbox_.front()),
                    [self = shared_from_this()](error_code error, size_t) {
                      self->write_begun_.reset();
                      if (error) return self->close();
                      self->outbox_bytes_ -= self->outbox_.front().size();
                      self->outbox_.pop_front();
                      if (!self->outbox_.empty()) return self->write();
                      if (self->no_more_input_) self->close_when_done();
                    });
}

void Connection::close_when_done() {
  if (outbox_.empty() && pending_ == 0) close();
}

void Connection::check(Time now) {
  if (line_begun_ && now - *line_begun_ > ConnectionBounds::line_patience) {
    drop(fmt::format("did not end its line within {} s", ConnectionBounds::line_patience.count()));
  } else if (write_begun_ && now - *write_begun_ > ConnectionBounds::write_patience) {
    drop(fmt::format("has not read for {} s", ConnectionBounds::write_patience.count()));
  }
}

void Connection::drop(const std::string& why) {
  reception_->log.warn(fmt::format("{} {}: connection closed", in_words(peer_), why));
  close();
}

void Connection::close() {
  if (!socket_.is_open()) return;
  error_code ignored;
  socket_.close(ignored);
  resume_.cancel();
  reception_->lease.release(number_);
  reception_->connections.erase(number_);
}

}  // namespace diastole
