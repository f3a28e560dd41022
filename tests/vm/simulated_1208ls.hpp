#pragma once
// What a USB-1208LS does with the reports it gets, apart from how they reach it: takes commands, makes blocks.

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace diastole::vm {

/// Conversion k of a scan reads k modulo 2048 counts.
class Simulated1208ls {
 public:
  /// One output report, without its id.
  void command(std::span<const uint8_t> report) {
    if (report.empty()) return;
    if (report[0] == 0x0E) {
      ++scans;
      block_ = 0;
    }
    if (report[0] == 0x07) channels = report[1];
    if (report[0] == 0x10) ++stops;
  }

  /// The 104 bytes behind the report's id.
  std::vector<uint8_t> next_block() {
    while (lost(block_))
      ++block_;
    std::vector<uint8_t> bytes(104);
    for (size_t pair = 0; pair < 32; ++pair) {
      const unsigned s0 = (64 * block_ + 2 * pair) % 2048;
      const unsigned s1 = s0 + 1;
      bytes[3 * pair] = static_cast<uint8_t>(s0);
      bytes[3 * pair + 1] = static_cast<uint8_t>((s0 >> 4U & 0xF0U) | s1 >> 8U);
      bytes[3 * pair + 2] = static_cast<uint8_t>(s1);
    }
    ++block_;
    bytes[101] = static_cast<uint8_t>(block_);
    bytes[102] = static_cast<uint8_t>(block_ >> 8U);
    return bytes;
  }

  std::function<bool(unsigned block)> lost = [](unsigned) { return false; };
  std::atomic<int> scans = 0;
  std::atomic<int> stops = 0;
  std::atomic<int> channels = 0;

 private:
  unsigned block_ = 0;
};

/// HID report descriptor: 8 bytes in, 8 bytes out, 104 bytes feature, no report ids.
inline constexpr uint8_t report_descriptor[] = {
    0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01,   // vendor page, usage 1, collection
    0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08,   // 0 ... 255, 8 bits
    0x95, 0x08, 0x09, 0x01, 0x81, 0x02,         // 8 x input
    0x95, 0x08, 0x09, 0x02, 0x91, 0x02,         // 8 x output
    0x95, 0x68, 0x09, 0x03, 0xB1, 0x02, 0xC0};  // 104 x feature

}  // namespace diastole::vm
