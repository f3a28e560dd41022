#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "protocol/wire/crc32.hpp"

namespace diastole::wire {
namespace {

TEST(Crc32, MatchesThePublishedCheckValue) {
  const std::string_view text = "123456789";
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  EXPECT_EQ(crc32(bytes), 0xCBF43926U);
}

TEST(Crc32, OfNothingIsZero) { EXPECT_EQ(crc32({}), 0U); }

}  // namespace
}  // namespace diastole::wire
