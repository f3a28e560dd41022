#pragma once
// The bytes of an MCC USB-1208LS in scan mode. No I/O here: bytes in, values out.
//
// The host sends output reports of 8 bytes, the rest 0 (HID report id 0 in front is not counted):
//
//   load queue   07  n  q0 ... q5      n = 1, 2, 4; q = channel | range << 4 | 0x80
//   scan         0E  count lo  hi  preload  prescale  options      options 0x04 = blocks, without end
//   stop         10
//
// A scan takes the queue's channels in turn; its conversions, all channels together, come at
//
//   rate = 6 MHz / (2^(prescale + 1) x counts)     prescale 1 ... 7, counts 1 ... 256
//   preload = 256 - counts + reload                reload: counts that the timer loses when it starts over,
//                                                  1 at prescale 4, 3, 6, 10 at 3, 2, 1 (as the maker has it)
//
// "300 Hz" is thus 300.48 Hz (prescale 6, counts 156, preload 100). Every 64 conversions make a block, which the host
// fetches as a feature report of 105 bytes; the device answers when the block is full:
//
//   offset  0        1 ... 96                  97     98 99     100 101    102 103      104
//          +--------+-------------------------+------+---------+----------+------------+--------+
//          | report | 32 x 3 bytes: b0 b1 b2  | error| read at | write at | block LE   | unused |
//          +--------+-------------------------+------+---------+----------+------------+--------+
//   three bytes hold two conversions of 12 bits, two's complement:
//          s0 = b0 | (b1 & 0xF0) << 4          s1 = b2 | (b1 & 0x0F) << 8
//
// `block` counts the blocks of the scan from 1, modulo 65536: a hole in it is a block lost. Example: the three
// bytes 34 F1 FF hold s0 = 0xF34 = -204 and s1 = 0x1FF = 511; at a range of +-10 V, which 2047 counts make,
// -0.9966 V and 2.4963 V.

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace diastole::daq::usb1208ls {

inline constexpr uint16_t vendor_id = 0x09DB;
inline constexpr uint16_t product_id = 0x007A;
inline constexpr size_t block_conversions = 64;
inline constexpr size_t block_report_bytes = 105;
inline constexpr double most_conversions_Hz = 1200;  ///< that blocks can carry
inline constexpr double least_conversions_Hz = 100;

using Command = std::array<uint8_t, 8>;

/// A differential range: what `code` means in the queue.
struct Range {
  double volts;
  uint8_t code;
};
inline constexpr std::array<Range, 8> ranges{
    {{20, 0x00}, {10, 0x10}, {5, 0x20}, {4, 0x30}, {2.5, 0x40}, {2, 0x50}, {1.25, 0x60}, {1, 0x70}}};

struct QueueEntry {
  uint8_t channel = 0;  ///< 0 ... 3, differential
  Range range = ranges[1];
};

/// How the device's timer makes a rate.
struct Pace {
  uint8_t prescale = 7;
  unsigned counts = 256;
  [[nodiscard]] double rate_Hz() const;
  [[nodiscard]] uint8_t preload() const;
};

/// The nearest that the timer can make, for rates of least_ to most_conversions_Hz.
Pace pace_for(double conversions_Hz);

/// Precondition: 1, 2 or 4 entries.
Command load_queue(std::span<const QueueEntry> queue);
Command start_scan(Pace pace);
Command stop_scan();

struct Block {
  uint16_t number = 0;  ///< from 1, modulo 65536
  uint8_t error = 0;
  std::array<int16_t, block_conversions> counts{};
};

/// None if the report has another length.
std::optional<Block> decode_block(std::span<const uint8_t> report);

/// Numbers the blocks without end: 0 is the first. None if the block is not behind the last one, whatever was
/// lost between (up to 32767 blocks).
class BlockCounter {
 public:
  std::optional<uint64_t> take(uint16_t number);

 private:
  uint64_t next_ = 0;
};

[[nodiscard]] inline double volts(int16_t counts, Range range) { return range.volts * counts / 2047.0; }

}  // namespace diastole::daq::usb1208ls
