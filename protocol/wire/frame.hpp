#pragma once
// One frame on the serial line. Before stuffing:
//
//   offset  size  field
//        0     2  session   chosen by the host when it opens the link, little-endian
//        2     1  kind      FrameKind
//        3     1  type      MessageType of the payload; 0 in link-control frames
//        4     1  seq       number of this frame when kind = sequenced, else 0
//        5     1  ack       number of the next sequenced frame that the sender expects
//        6     n  payload   0 <= n <= 244
//      6+n     4  crc       CRC-32 (crc32.hpp) of bytes 0 … 5+n, little-endian
//
// Then COBS (Cheshire & Baker 1999) removes every 0x00, and one 0x00 ends the frame. A frame is at most 254
// bytes before stuffing, so COBS costs exactly one byte and an encoded frame has 12 … 256 bytes.
//
//   Example: session 0x1234, kind datagram, type 0x02, seq 0, ack 3, payload 07 00
//     plain    34 12 04 02 00 03 07 00 E1 36 B2 38
//     encoded  05 34 12 04 02 03 03 07 05 E1 36 B2 38 00
//
// This layout and the messages HelloRequest and Hello never change, so that any two versions can report to each
// other that they do not match.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/crc32.hpp"
#include "protocol/wire/result.hpp"

namespace diastole::wire {

inline constexpr std::size_t kHeaderBytes = 6;
inline constexpr std::size_t kCrcBytes = 4;
inline constexpr std::size_t kMaxPlainBytes = 254;
inline constexpr std::size_t kMaxPayloadBytes = kMaxPlainBytes - kHeaderBytes - kCrcBytes;
inline constexpr std::size_t kMaxEncodedBytes = kMaxPlainBytes + 2;

enum class FrameKind : std::uint8_t {
  open = 0,       ///< host → controller: start session `session`; numbers begin at 0 on both sides
  open_ack = 1,   ///< controller → host: session `session` is open
  closed = 2,     ///< controller → host: I do not know `session` (I was reset, or another host opened)
  ack = 3,        ///< bare acknowledgement
  datagram = 4,   ///< delivered at most once, never repeated (heartbeats, time marks)
  sequenced = 5,  ///< delivered exactly once and in order
};

struct FrameHeader {
  std::uint16_t session = 0;
  FrameKind kind = FrameKind::ack;
  std::uint8_t type = 0;
  std::uint8_t seq = 0;
  std::uint8_t ack = 0;
};

/// A decoded frame; `payload` lies in the decoder's memory and lives until the next byte is pushed.
struct Frame {
  FrameHeader header;
  std::span<const std::uint8_t> payload;
};

enum class FrameFault : std::uint8_t {
  none = 0,
  truncated,  ///< ended inside a COBS block, or shorter than header + CRC
  too_long,   ///< more than kMaxPlainBytes; the rest up to the next 0x00 is skipped
  bad_crc,
  bad_kind,  ///< intact, but of a kind that this version does not know
};

/// Encodes one frame into `out` and returns the bytes used (a prefix of `out`).
/// Precondition: payload.size() <= kMaxPayloadBytes.
std::span<const std::uint8_t> encode_frame(const FrameHeader& header, std::span<const std::uint8_t> payload,
                                           std::span<std::uint8_t, kMaxEncodedBytes> out);

/// One byte in; a frame, a fault or nothing yet out. After any garbage it is in step again at the next 0x00.
class FrameDecoder {
 public:
  std::optional<Result<Frame, FrameFault>> push(std::uint8_t byte);

 private:
  std::optional<Result<Frame, FrameFault>> finish();
  void store(std::uint8_t byte);
  void restart();

  std::array<std::uint8_t, kMaxPlainBytes> plain_{};
  std::size_t size_ = 0;
  std::uint8_t left_in_block_ = 0;  ///< data bytes still to come in the present COBS block
  bool started_ = false;
  bool zero_due_ = false;  ///< the present block stands for a 0x00 after its data, if another block follows
  bool too_long_ = false;
};

}  // namespace diastole::wire
