#pragma once
// One client of the daemon's socket: lines to and fro. It can cost the rig nothing: what it sends, what waits for it
// and how long are bounded, and whoever goes beyond a bound is answered or dropped, and the log tells.

#include <array>
#include <map>
#include <optional>

#include "host/rpc/rpc_session.hpp"

namespace diastole {

class Connection;

using Connections = std::map<uint64_t, std::shared_ptr<Connection>>;

class Connection : public RpcSession {
 public:
  /// For the rest of a line that was begun.
  static constexpr std::chrono::seconds line_patience{10};

  /// Removes itself from `all` when it closes.
  Connection(std::shared_ptr<RpcState> rpc_state, std::shared_ptr<Connections> all,
             boost::asio::local::stream_protocol::socket socket);

  void read();
  /// Drops the connection if a half line or an unread answer has waited too long.
  void check(Time now);
  void close() override;

 private:
  std::shared_ptr<Connection> self() { return std::static_pointer_cast<Connection>(shared_from_this()); }
  void take_more() override;
  /// Answers the next line; false if none has come whole, or none may be taken now.
  bool take_line();
  void ended_by_peer();
  void refuse_long_line();
  void write(const std::string& line) override;
  [[nodiscard]] bool is_open() const override { return socket_.is_open(); }
  void close_when_done();

  std::shared_ptr<Connections> all_;
  boost::asio::local::stream_protocol::socket socket_;
  std::array<char, 16384> block_{};
  std::string inbox_;
  size_t taken_ = 0;     // bytes of inbox_ that are answered
  size_t searched_ = 0;  // bytes of inbox_ that hold no newline
  bool no_more_input_ = false;
  std::optional<Time> line_begun_;
  std::optional<Time> write_begun_;
};

}  // namespace diastole
