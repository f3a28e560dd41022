#pragma once

#include <gtest/gtest.h>

#include <string>

#include "estimator/effects/effect.hpp"

namespace diastole {

/// A test's name for an effect: its id without hyphens.
inline std::string test_name(const testing::TestParamInfo<const Effect*>& info) {
  std::string name(info.param->text().id);
  std::erase(name, '-');
  return name;
}

}  // namespace diastole
