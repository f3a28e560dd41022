// The wiring page names the pins that the firmware uses.

#include <gmock/gmock.h>

#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace {

const std::string source_root = DIASTOLE_SOURCE_DIR;

std::vector<std::string> lines_of(const std::string& file) {
  std::ifstream stream(source_root + "/" + file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

/// "PA1 TTL TIM2_CH2 (AF1) out": one a line that `row` matches.
std::vector<std::string> pins_in(const std::string& file, const std::regex& row) {
  std::vector<std::string> pins;
  for (const std::string& line : lines_of(file)) {
    std::smatch match;
    if (std::regex_search(line, match, row))
      pins.push_back(match[1].str() + " " + match[2].str() + " " + match[3].str() + " " + match[4].str());
  }
  return pins;
}

TEST(WiringPage, HasThePinsOfTheFirmware) {
  const auto firmware =
      pins_in("firmware/boards/stm32f405/pins.hpp",
              std::regex(R"(^//   (P[A-D]\d+) +(\S+(?: \S+)*?)  +(\S+(?: \S+)*?)  +(in|out)\b)"));
  const auto page =
      pins_in("docs/wiring.md", std::regex(R"(^\| (P[A-D]\d+) \| ([^|]+?) \| ([^|]+?) \| (in|out) \|)"));
  EXPECT_EQ(firmware.size(), 11U);
  EXPECT_THAT(page, testing::ElementsAreArray(firmware));
}

TEST(WiringPage, TheDrawingNamesThemToo) {
  std::stringstream drawing;
  drawing << std::ifstream(source_root + "/docs/figures/wiring.svg").rdbuf();
  for (const std::string& pin :
       pins_in("docs/wiring.md", std::regex(R"(^\| (P[A-D]\d+) \| ([^|]+?) \| ([^|]+?) \| (in|out) \|)"))) {
    const std::string name = pin.substr(0, pin.find(' '));
    EXPECT_TRUE(std::regex_search(drawing.str(), std::regex(name + R"(\b)"))) << name;
  }
}

}  // namespace
