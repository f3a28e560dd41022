#include "protocol/contract/text.hpp"

#include <gtest/gtest.h>

namespace diastole {
namespace {

TEST(Text, IsTrimmedOfBlanksAndLineEnds) {
  EXPECT_EQ(trimmed(" \ta b\r\n"), "a b");
  EXPECT_EQ(trimmed("a"), "a");
  EXPECT_EQ(trimmed(" \r\n"), "");
  EXPECT_EQ(trimmed(""), "");
}

TEST(Text, IsANumberOnlyAsAWhole) {
  EXPECT_EQ(parse_number<double>("-1.5e2"), -150.0);
  EXPECT_EQ(parse_number<int>("7"), 7);
  for (const char* other : {"", " 7", "7 ", "+7", "7mL", "seven", "7,8"})
    EXPECT_FALSE(parse_number<double>(other)) << other;
  EXPECT_FALSE(parse_number<int>("7.0"));
  EXPECT_FALSE(parse_number<uint16_t>("65536"));
  EXPECT_FALSE(parse_number<uint16_t>("-1"));
}

TEST(Text, HoldsAsManyNumbersAsAreAskedFor) {
  EXPECT_EQ((parse_numbers<int, 3>("8,4,1")), (std::array{8, 4, 1}));
  for (const char* other : {"", "8", "8,4", "8,4,", "8,4,1,", "8,4,1,1", "8, 4,1", "8,x,1", "8;4;1"})
    EXPECT_FALSE((parse_numbers<int, 3>(other))) << other;
}

TEST(Text, HasCharactersOfSeveralBytes) {
  EXPECT_EQ(characters_of("a½€😀"), 4U);
  EXPECT_EQ(character_at("a½b", 1), "½");
  EXPECT_EQ(character_at("a½", 0), "a");
  EXPECT_EQ(character_at("½", 0), "½");
}

TEST(Text, IsQuotedForToml) { EXPECT_EQ(toml_text("a \"b\" \\ c\n"), R"("a \"b\" \\ c")"); }

}  // namespace
}  // namespace diastole
