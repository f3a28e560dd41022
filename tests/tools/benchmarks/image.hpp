#pragma once
// The image under test, and the unit of its times.

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace diastole::step_path_test {

inline constexpr uint64_t ms = 1'000'000;  // ns

inline const std::string image = DIASTOLE_SOURCE_DIR "/build/firmware/bin/diastole-stm32f405.elf";

#define NEEDS_IMAGE()                                            \
  if (!std::filesystem::exists(diastole::step_path_test::image)) \
  GTEST_SKIP() << "no " << diastole::step_path_test::image << ": build the preset `firmware` first"

}  // namespace diastole::step_path_test
