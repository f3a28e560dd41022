#pragma once
// The one right to give orders to the rig. It is granted to the connection that asks first, and lasts until
// that connection releases it or closes, or until somebody takes it over by naming who holds it: a takeover is
// never an accident, and never silent.

#include <cstdint>
#include <optional>
#include <string>

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
  void claim(uint64_t connection, const Peer& peer);

  /// Takes the lease from the holder whom `named` means, by user name or process number; granted likewise if
  /// it is free. Returns who held it, if another connection did. Throws rpc::Error control_held if somebody
  /// else than the one named holds it.
  std::optional<Peer> take_over(uint64_t connection, const Peer& peer, const std::string& named);

  /// Gives the lease back if `connection` holds it.
  void release(uint64_t connection);

  [[nodiscard]] const std::optional<Holder>& holder() const { return holder_; }

 private:
  std::optional<Holder> holder_;
};

}  // namespace diastole
