#pragma once
// The image that the preset `firmware` makes; without it the tests that need it are skipped.

#include <string>

namespace diastole::sim_board_test {

inline const std::string firmware = DIASTOLE_SOURCE_DIR "/build/firmware/bin/diastole-stm32f405.elf";

}  // namespace diastole::sim_board_test
