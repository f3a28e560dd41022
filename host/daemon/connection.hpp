#pragma once
// One client of the daemon's socket. It can cost the rig nothing: what it sends, what waits for it and how
// long are bounded, and whoever goes beyond a bound is answered or dropped, and the log tells.

#include <utility>  // before Asio, which uses std::exchange without it

#include <array>
#include <boost/asio.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "host/daemon/control_lease.hpp"
#include "host/daemon/json_rpc.hpp"
#include "host/daemon/peer.hpp"
#include "host/daemon/quiet_log.hpp"
#include "host/daemon/rig_service.hpp"

namespace diastole {

class Connection;

/// What all connections of a server share; used on the server's thread only.
struct Reception {
  boost::asio::io_context& context;
  RigService& rig;
  ControlPolicy policy;
  ControlLease lease{};
  QuietLog log{};
  std::map<uint64_t, std::shared_ptr<Connection>> connections{};
};

/// Bounds of one connection.
struct ConnectionBounds {
  static constexpr size_t most_unread_bytes = 256U << 10;  ///< answers that the client has not read
  static constexpr int most_pending = 8;                   ///< requests that wait for the rig
  static constexpr int lines_in_window = 50;               ///< beyond it reading pauses until the next window
  static constexpr std::chrono::milliseconds window{100};
  static constexpr std::chrono::seconds line_patience{10};   ///< for the rest of a line that was begun
  static constexpr std::chrono::seconds write_patience{10};  ///< for a client that does not read
};

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  using Time = std::chrono::steady_clock::time_point;

  Connection(uint64_t number, std::shared_ptr<Reception> reception,
             boost::asio::local::stream_protocol::socket socket);

  void read();
  /// Drops the connection if a half line or an unread answer has waited too long.
  void check(Time now);
  /// Closes at once, and tells the log why.
  void drop(const std::string& why);
  void close();

  [[nodiscard]] uint64_t number() const { return number_; }
  [[nodiscard]] Time last_line() const { return last_line_; }
  [[nodiscard]] bool controls() const;

 private:
  void take_lines();
  /// Answers the next line; false if none has come whole, or none may be taken now.
  bool take_line();
  void ended_by_peer();
  void refuse_long_line();
  void answer(std::string_view line);
  void dispatch(const rpc::Request& request);
  void take_control(const rpc::Request& request);
  void require_permission() const;
  nlohmann::json control() const;
  /// Brings an answer from the rig's thread to this connection's.
  RigService::Done reply_to(const nlohmann::json& id, bool with_control);
  void deliver(const nlohmann::json& id, bool with_control, const std::exception_ptr& error,
               nlohmann::json result);
  void send(std::string line);
  void write();
  void close_when_done();

  uint64_t number_;
  std::shared_ptr<Reception> reception_;
  boost::asio::local::stream_protocol::socket socket_;
  boost::asio::steady_timer resume_;
  Peer peer_;
  std::array<char, 16384> block_{};
  std::string inbox_;
  size_t taken_ = 0;     // bytes of inbox_ that are answered
  size_t searched_ = 0;  // bytes of inbox_ that hold no newline
  Time window_began_{};
  int lines_left_ = ConnectionBounds::lines_in_window;
  int pending_ = 0;
  bool waiting_ = false;  // reading pauses until the rig has answered
  std::deque<std::string> outbox_;
  size_t outbox_bytes_ = 0;
  bool no_more_input_ = false;
  Time last_line_;
  std::optional<Time> line_begun_;
  std::optional<Time> write_begun_;
};

}  // namespace diastole
