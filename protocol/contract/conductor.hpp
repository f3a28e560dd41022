#pragma once
// Conducted time: how a simulated rig and the daemon agree on what the time is, so that a session runs as
// fast as the machine goes, is the same every time, and loses nothing on a loaded machine.
//
// The rig listens on a unix stream socket; the daemon connects once. Virtual time moves only when the
// daemon's acquisition loop asks for it, one question and one answer at a time, all integers little-endian:
//
//   daemon -> rig    0                               8                              16
//                    +-------------------------------+-------------------------------+
//                    | until_ns                      | serial_bytes_written_total    |
//                    +-------------------------------+-------------------------------+
//   rig -> daemon    0                               8                              16
//                    +-------------------------------+-------------------------------+
//                    | now_ns                        | serial_bytes_sent_total       |
//                    +-------------------------------+-------------------------------+
//
// The rig reads its end of the serial line until it has taken serial_bytes_written_total bytes, advances
// controller and plant to until_ns (which sends serial bytes), and answers. The daemon reads its end until it
// has serial_bytes_sent_total bytes, and only then goes on. Each of these waits ends after one second of wall
// time at the latest. The totals count from the moment the daemon opened the serial port, when both are 0.
// until_ns at or before the rig's present does not move time; the answer states the present.
//
// While the daemon waits for its instrument, time stands still, unless the answer is late or will not come. Then the
// rig moves time on by itself, to the answer or to the end of the daemon's timeout (timeout_ms of the rig file),
// and says so unasked, before it answers or closes the connection: an Advanced whose serial_bytes_sent_total is
// 2^64 - 1.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace diastole::conductor {

/// What the daemon asks.
struct Advance {
  uint64_t until_ns = 0;
  uint64_t serial_bytes_written_total = 0;
  bool operator==(const Advance&) const = default;
};

/// What the rig answers.
struct Advanced {
  uint64_t now_ns = 0;
  uint64_t serial_bytes_sent_total = 0;
  bool operator==(const Advanced&) const = default;
};

inline constexpr uint64_t unsolicited = UINT64_MAX;  ///< serial_bytes_sent_total of what the rig says unasked

using Record = std::array<std::byte, 16>;

namespace detail {
struct Pair {
  uint64_t first, second;
};
inline Record to_bytes(Pair pair) {
  static_assert(std::endian::native == std::endian::little, "the records are little-endian");
  return std::bit_cast<Record>(pair);
}
}  // namespace detail

inline Record encode(const Advance& a) {
  return detail::to_bytes({a.until_ns, a.serial_bytes_written_total});
}
inline Record encode(const Advanced& a) { return detail::to_bytes({a.now_ns, a.serial_bytes_sent_total}); }

inline Advance decode_advance(const Record& record) {
  const auto pair = std::bit_cast<detail::Pair>(record);
  return {pair.first, pair.second};
}
inline Advanced decode_advanced(const Record& record) {
  const auto pair = std::bit_cast<detail::Pair>(record);
  return {pair.first, pair.second};
}

}  // namespace diastole::conductor
