#pragma once
// Requests that are alike but for their numbers: those that hold nothing but a request id, and those that also hold
// the lease on which the motion depends. Each stands, with its example, where it is named.

#include <cstdint>

#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole::wire {

/// `example_id` is the request id of the example.
template <MessageType type, std::uint16_t example_id = 0x0107>
struct BareRequest {
  static constexpr MessageType kType = type;
  std::uint16_t request_id = 0;  ///< chosen by the host; the answer repeats it

  static constexpr void layout(auto& self, auto& visit) { visit.field("request_id", self.request_id); }
  static constexpr BareRequest example() { return {example_id}; }
};

template <MessageType type, std::uint16_t example_id>
struct LeaseRequest {
  static constexpr MessageType kType = type;
  std::uint16_t request_id = 0;
  std::uint32_t lease_id = 0;  ///< the lease whose heartbeats keep the motor going

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.field("lease_id", self.lease_id);
  }
  static constexpr LeaseRequest example() { return {example_id, 0x11223344}; }
};

}  // namespace diastole::wire
