#include "protocol/contract/plain_text.hpp"

#include <gtest/gtest.h>

namespace diastole {
namespace {

TEST(PlainText, IsUtf8WithoutControlCharacters) {
  for (const char* text :
       {"", "a note\n\tof two lines", "of\r\nWindows", "30 °C – warm", "\xF0\x9F\x92\xA7", "\xEF\xBF\xBD"}) {
    EXPECT_EQ(why_not_plain(text), "") << text;
    EXPECT_EQ(made_plain(text), text);
  }
}

TEST(PlainText, RefusesWhatSteersATerminal) {
  EXPECT_EQ(why_not_plain("red \x1b[31m"), "holds the control character 0x1b at byte 4");
  EXPECT_EQ(made_plain("red \x1b[31m"), "red \xEF\xBF\xBD[31m");
  for (const char* text : {"\r", "\b", "\x7f",
                           "\xC2\x9B"
                           "31m"})
    EXPECT_NE(why_not_plain(text), "");
  EXPECT_NE(why_not_plain(std::string_view("a\0b", 3)), "");
}

TEST(PlainText, RefusesWhatIsNotUtf8) {
  EXPECT_EQ(why_not_plain("warm\xE4"), "is not UTF-8 at byte 4");
  EXPECT_EQ(made_plain("warm\xE4!"), "warm\xEF\xBF\xBD!");
  // A lone continuation, two overlong forms, a surrogate, one beyond Unicode, one cut off.
  for (const char* text :
       {"\x80", "\xC0\xAF", "\xE0\x80\xAF", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xE2\x82"})
    EXPECT_EQ(why_not_plain(text), "is not UTF-8 at byte 0");
}

TEST(PlainText, OfOthersIsPrintedSo) {
  testing::internal::CaptureStdout();
  print_plain("  {:.1f} s {}: {}\n", 3.0, "warning", "\x1b[31mred");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "  3.0 s warning: \xEF\xBF\xBD[31mred\n");
}

}  // namespace
}  // namespace diastole
