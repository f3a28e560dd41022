#pragma once
// The image under test.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace diastole::step_path_test {

inline const std::string image = DIASTOLE_SOURCE_DIR "/build/firmware/bin/diastole-stm32f405.elf";

#define NEEDS_IMAGE()                                            \
  if (!std::filesystem::exists(diastole::step_path_test::image)) \
  GTEST_SKIP() << "no " << diastole::step_path_test::image << ": build the preset `firmware` first"

}  // namespace diastole::step_path_test
