#pragma once
// The host's lease: motion goes on only while heartbeats with the right number keep coming.

#include <cstdint>

#include "firmware/core/units.hpp"

namespace diastole::firmware {

class Lease {
 public:
  /// A heartbeat came. While motion depends on a lease, others do not count.
  void heartbeat(std::uint32_t lease_id, Ticks now) {
    if (bound_ && lease_id != lease_id_) return;
    lease_id_ = lease_id;
    last_ = now;
    seen_ = true;
  }
  /// Makes motion depend on this lease, with at most so much silence; false if it has not been heard within that.
  bool bind(std::uint32_t lease_id, Ticks now, Ticks silence) {
    if (!seen_ || lease_id != lease_id_ || now - last_ > silence) return false;
    bound_ = true;
    silence_ = silence;
    return true;
  }
  void release() { bound_ = false; }
  [[nodiscard]] bool lost(Ticks now) const { return bound_ && now - last_ > silence_; }

 private:
  std::uint32_t lease_id_ = 0;
  Ticks last_;
  Ticks silence_;
  bool seen_ = false;
  bool bound_ = false;
};

}  // namespace diastole::firmware
