#pragma once
// A board with one of the test images in its flash, powered on.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tools/sim_board/sim_board.hpp"

namespace diastole::sim_board_test {

inline constexpr uint32_t flash_start = 0x0800'0000, seen_start = 0x2000'0000;
inline constexpr uint64_t ms = 1'000'000;  // ns

/// Bytes of images/NAME.bin, empty when it was not built (no cross compiler).
inline std::vector<uint8_t> image_bytes(const std::string& name) {
  std::ifstream file(std::string(SIM_BOARD_IMAGES) + "/" + name + ".bin", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Skips the test, visibly, when there is no image to run.
#define BOARD_WITH(board, name)                                                               \
  const auto board##_image = sim_board_test::image_bytes(name);                               \
  if (board##_image.empty()) GTEST_SKIP() << "no arm-none-eabi-g++ when this was configured"; \
  SimBoard board;                                                                             \
  board.load(board##_image, sim_board_test::flash_start);                                     \
  board.power_on()

/// Word `index` of what the image lets the test see.
inline uint32_t seen(const SimBoard& board, uint32_t index) {
  return board.word(seen_start + 4 * index).value_or(0xbad0'bad0);
}

/// The events of one pin.
inline std::vector<SimBoard::PinEvent> of_pin(const std::vector<SimBoard::PinEvent>& events,
                                              SimBoard::Pin pin) {
  std::vector<SimBoard::PinEvent> found;
  for (const auto& event : events) {
    if (event.dac == 0 && event.pin == pin) found.push_back(event);
  }
  return found;
}

}  // namespace diastole::sim_board_test
