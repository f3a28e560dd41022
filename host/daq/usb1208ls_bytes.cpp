#include "host/daq/usb1208ls_bytes.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::daq::usb1208ls {
namespace {

constexpr double clock_Hz = 6e6;
constexpr uint8_t blocks_without_end = 0x04;

int16_t sign_extended(unsigned twelve_bits) {
  return static_cast<int16_t>((twelve_bits & 0x800U) != 0 ? static_cast<int>(twelve_bits) - 0x1000
                                                          : static_cast<int>(twelve_bits));
}

}  // namespace

double Pace::rate_Hz() const { return clock_Hz / ((2U << prescale) * static_cast<double>(counts)); }

uint8_t Pace::preload() const {
  constexpr std::array<unsigned, 8> reload{0, 10, 6, 3, 1, 0, 0, 0};
  return static_cast<uint8_t>(256 - counts + reload[prescale]);
}

/// The least divider whose counter still reaches the rate is the finest.
Pace pace_for(double conversions_Hz) {
  for (uint8_t prescale = 1; prescale <= 7; ++prescale) {
    const double counts = std::round(clock_Hz / ((2U << prescale) * conversions_Hz));
    if (counts <= 256) return {prescale, static_cast<unsigned>(std::max(1.0, counts))};
  }
  return {};
}

Command load_queue(std::span<const QueueEntry> queue) {
  Command command{0x07, static_cast<uint8_t>(queue.size())};
  for (size_t i = 0; i < queue.size(); ++i)
    command[2 + i] = static_cast<uint8_t>((queue[i].channel & 7U) | queue[i].range.code | 0x80U);
  return command;
}

Command start_scan(Pace pace) {
  return {0x0E, block_conversions, 0, pace.preload(), pace.prescale, blocks_without_end};
}

Command stop_scan() { return {0x10}; }

std::optional<Block> decode_block(std::span<const uint8_t> report) {
  if (report.size() != block_report_bytes) return std::nullopt;
  Block block;
  for (size_t pair = 0; pair < block_conversions / 2; ++pair) {
    const auto b = report.subspan(1 + 3 * pair, 3);
    block.counts[2 * pair] = sign_extended(b[0] | (b[1] & 0xF0U) << 4U);
    block.counts[2 * pair + 1] = sign_extended(b[2] | (b[1] & 0x0FU) << 8U);
  }
  block.error = report[97];
  block.number = static_cast<uint16_t>(report[102] | report[103] << 8);
  return block;
}

std::optional<uint64_t> BlockCounter::take(uint16_t number) {
  const auto ahead = static_cast<uint16_t>(number - 1 - next_);
  if (ahead > 0x7FFF) return std::nullopt;
  const uint64_t index = next_ + ahead;
  next_ = index + 1;
  return index;
}

}  // namespace diastole::daq::usb1208ls
