#pragma once
// The one right to give orders to the rig. It is granted to the connection that asks first, and lasts until
// that connection releases it or closes, or until somebody takes it over by naming who holds it: a takeover is
// never an accident, and never silent.

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <string>

#include "host/rpc/json_rpc.hpp"
#include "host/rpc/peer.hpp"

namespace diastole {

class ControlLease {
 public:
  struct Holder {
    uint64_t connection = 0;
    Peer peer;
  };

  /// Grants the lease if it is free; nothing changes if `connection` holds it already. Throws rpc::Error
  /// control_held, naming the holder, if another does.
  void claim(uint64_t connection, const Peer& peer) {
    if (holder_ && holder_->connection != connection) refuse(holder_->peer);
    holder_ = Holder{connection, peer};
  }

  /// Takes the lease from the holder whom `named` means, by user name or process number; granted likewise if
  /// it is free. Returns who held it, if another connection did. Throws rpc::Error control_held if somebody
  /// else than the one named holds it.
  std::optional<Peer> take_over(uint64_t connection, const Peer& peer, const std::string& named) {
    const std::optional<Holder> before = holder_;
    const bool from_another = before && before->connection != connection;
    if (from_another && !means(named, before->peer)) refuse(before->peer);
    holder_ = Holder{connection, peer};
    return from_another ? std::optional(before->peer) : std::nullopt;
  }

  /// Gives the lease back if `connection` holds it.
  void release(uint64_t connection) {
    if (holder_ && holder_->connection == connection) holder_.reset();
  }

  [[nodiscard]] const std::optional<Holder>& holder() const { return holder_; }

 private:
  [[noreturn]] static void refuse(const Peer& holder) {
    throw rpc::Error(
        rpc::Code::control_held,
        fmt::format("the rig is controlled by {0}; if that is agreed, take it over: --take-over {1}",
                    in_words(holder), holder.user),
        as_json(holder));
  }

  static bool means(const std::string& named, const Peer& holder) {
    return named == holder.user || (holder.console.empty() && named == fmt::to_string(holder.pid));
  }

  std::optional<Holder> holder_;
};

}  // namespace diastole
