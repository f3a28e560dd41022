#pragma once
// One client of the daemon, whichever door it came in by: the unix socket (connection.hpp) or the web console
// (host/web). Here stand the rules that hold for all: who may give orders, the one control lease, how many requests
// a second are taken and how many may wait for the rig. A door only carries messages to and fro.

#include <utility>  // before Asio, which uses std::exchange without it

#include <boost/asio.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "host/rpc/control_lease.hpp"
#include "host/rpc/json_rpc.hpp"
#include "host/rpc/methods.hpp"
#include "host/rpc/peer.hpp"
#include "host/rpc/quiet_log.hpp"

namespace diastole {

/// What all clients share; used on the server's thread only.
struct RpcState {
  boost::asio::io_context& context;
  RigService& rig;
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
  static constexpr std::chrono::seconds write_patience{10};  ///< for a client that does not read
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
  [[nodiscard]] bool controls() const;
  /// Closes at once; the log says why.
  void drop(const std::string& why);
  virtual void close() = 0;

 protected:
  /// `requests_in_window`: of SessionBounds.
  RpcSession(std::shared_ptr<RpcState> rpc_state, Peer peer, int requests_in_window);

  /// Whether a request may be taken now; if not, take_more() is called when one may.
  [[nodiscard]] bool may_take();
  /// Carries out one request; the answer comes through send(), now or later.
  void answer(std::string_view request);
  /// The client is gone: it controls nothing any more.
  void leave();
  [[nodiscard]] int pending() const { return pending_; }
  [[nodiscard]] RpcState& rpc_state() const { return *rpc_; }
  /// Sends a message after those that wait; drops a client that does not read them.
  void send(std::string message);
  /// The message that write() was called with is out.
  void written();
  [[nodiscard]] bool all_sent() const { return outbox_.empty(); }

  [[nodiscard]] virtual bool is_open() const = 0;
  /// `message` stays as it is until written() is called.
  virtual void write(const std::string& message) = 0;
  virtual void take_more() = 0;

 private:
  void dispatch(const rpc::Request& request);
  /// Requests about the client itself; false if it is none.
  bool dispatch_own(const rpc::Request& request);
  void take_control(const rpc::Request& request);
  void sign_in(const rpc::Request& request);
  void require_permission() const;
  nlohmann::json control() const;
  /// Brings an answer from the rig's thread to the server's.
  Reply reply_to(const nlohmann::json& id, bool with_control);
  void deliver(const nlohmann::json& id, bool with_control, const std::exception_ptr& error,
               nlohmann::json result);

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
