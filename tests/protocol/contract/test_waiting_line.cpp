#include "protocol/contract/waiting_line.hpp"

#include <gmock/gmock.h>
#include <pty.h>
#include <unistd.h>

#include <array>
#include <string>

namespace diastole {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What a terminal has been shown when a line has lived for a time.
std::string shown(std::chrono::milliseconds time) {
  int master = -1, slave = -1;
  EXPECT_EQ(::openpty(&master, &slave, nullptr, nullptr, nullptr), 0);
  std::FILE* terminal = ::fdopen(slave, "w");
  {
    const WaitingLine line("reading gel.run.h5", terminal);
    std::this_thread::sleep_for(time);
  }
  std::fputs("end", terminal);
  std::fflush(terminal);
  std::string text;
  std::array<char, 256> block{};
  while (text.find("end") == std::string::npos) {
    const auto count = ::read(master, block.data(), block.size());
    if (count <= 0) break;
    text.append(block.data(), static_cast<size_t>(count));
  }
  std::fclose(terminal);
  ::close(master);
  return text.substr(0, text.find("end"));
}

TEST(WaitingLine, SaysNothingOfWhatIsSoonDone) {
  EXPECT_THAT(shown(std::chrono::milliseconds(20)), IsEmpty());
}

TEST(WaitingLine, TellsATerminalAfterTwoSecondsAndGoesAway) {
  const std::string text = shown(WaitingLine::quiet + std::chrono::milliseconds(500));
  EXPECT_THAT(text, HasSubstr("\rreading gel.run.h5: 2 s"));
  EXPECT_TRUE(text.ends_with("\r\033[K")) << text;
}

TEST(WaitingLine, SaysNothingToAFile) {
  std::FILE* file = std::tmpfile();
  {
    const WaitingLine line("reading", file);
    std::this_thread::sleep_for(WaitingLine::quiet + std::chrono::milliseconds(200));
  }
  EXPECT_EQ(std::ftell(file), 0);
  std::fclose(file);
}

}  // namespace
}  // namespace diastole
