#pragma once
// A fuzzer's bytes as a script of what happens on a line, so that most inputs get past framing and CRC:
//
//   raw        00 size bytes...                bytes as they are
//   message    01 type size payload...         through the reliable link: right session, number and CRC
//   frame      02 session kind type seq ack size payload...   a whole frame with any header; session 0 is the open one
//   time       03 count                        count x 4 ms pass
//   other      04 what                         for each target to interpret
//
// The first byte of a step counts modulo 5; a script may end anywhere.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "protocol/wire/frame.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole::fuzz {

enum class Step : std::uint8_t { raw, message, frame, time, other };

inline void must(bool holds) {
  if (!holds) std::abort();
}

class Script {
 public:
  explicit Script(std::span<const std::uint8_t> bytes) : left_(bytes) {}
  [[nodiscard]] bool done() const { return left_.empty(); }
  Step step() { return static_cast<Step>(byte() % 5); }
  std::uint8_t byte() {
    if (left_.empty()) return 0;
    const std::uint8_t first = left_[0];
    left_ = left_.subspan(1);
    return first;
  }
  /// A size and so many bytes, or as many as are left; no more than a frame holds.
  std::span<const std::uint8_t> sized() {
    const std::size_t size = std::min({std::size_t{byte()}, left_.size(), wire::kMaxPayloadBytes});
    const auto bytes = left_.first(size);
    left_ = left_.subspan(size);
    return bytes;
  }
  /// A whole frame from a `frame` step, encoded.
  std::span<const std::uint8_t> frame(std::uint16_t open_session,
                                      std::span<std::uint8_t, wire::kMaxEncodedBytes> memory) {
    const std::uint8_t session = byte();
    wire::FrameHeader header;
    header.session = session == 0 ? open_session : session;
    header.kind = static_cast<wire::FrameKind>(byte() % 8);
    header.type = byte();
    header.seq = byte();
    header.ack = byte();
    return wire::encode_frame(header, sized(), memory);
  }

 private:
  std::span<const std::uint8_t> left_;
};

/// Writes scripts, for seeds.
class ScriptWriter {
 public:
  ScriptWriter& raw(std::span<const std::uint8_t> bytes) {
    put(Step::raw);
    return sized(bytes);
  }
  ScriptWriter& message(wire::MessageType type, std::span<const std::uint8_t> payload) {
    put(Step::message);
    bytes_.push_back(static_cast<std::uint8_t>(type));
    return sized(payload);
  }
  ScriptWriter& time(std::uint8_t count) {
    put(Step::time);
    bytes_.push_back(count);
    return *this;
  }
  ScriptWriter& other(std::uint8_t what) {
    put(Step::other);
    bytes_.push_back(what);
    return *this;
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  void put(Step step) { bytes_.push_back(static_cast<std::uint8_t>(step)); }
  ScriptWriter& sized(std::span<const std::uint8_t> bytes) {
    bytes_.push_back(static_cast<std::uint8_t>(bytes.size()));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  std::vector<std::uint8_t> bytes_;
};

}  // namespace diastole::fuzz
