// Program sim_board as a person calls it: trace, report, flash kept between runs, power cuts, refusals.

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/tools/sim_board/test_image.hpp"

namespace diastole::sim_board_test {
namespace {

using ::testing::HasSubstr;

struct Outcome {
  int code = -1;
  std::string out, err;
};

class Program : public ::testing::Test {
 protected:
  void SetUp() override {
    if (image_bytes("steps").empty()) GTEST_SKIP() << "no arm-none-eabi-g++ when this was configured";
    directory_ = std::filesystem::temp_directory_path() / ("sim_board-" + std::to_string(::getpid()));
    std::filesystem::create_directories(directory_);
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  [[nodiscard]] std::string file(const std::string& name) const { return (directory_ / name).string(); }
  static std::string image(const std::string& name) { return std::string(SIM_BOARD_IMAGES) + "/" + name; }
  static std::string contents(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  [[nodiscard]] Outcome call(const std::string& arguments) const {
    const std::string command =
        std::string(DIASTOLE_BIN_DIR) + "/sim_board " + arguments + " 2>" + file("err");
    Outcome outcome;
    std::FILE* pipe = ::popen(command.c_str(), "r");
    std::array<char, 4096> block{};
    for (std::size_t got = 0; (got = std::fread(block.data(), 1, block.size(), pipe)) > 0;) {
      outcome.out.append(block.data(), got);
    }
    const int status = ::pclose(pipe);
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    outcome.err = contents(file("err"));
    return outcome;
  }

  std::filesystem::path directory_;
};

TEST_F(Program, WritesThePinTraceAndTheReport) {
  const Outcome outcome = call(image("steps.elf") + " --seconds 0.1 --json --pins " + file("pins.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto report = nlohmann::json::parse(outcome.out);
  EXPECT_NEAR(report.at("simulated_seconds").get<double>(), 0.1, 1e-5);
  EXPECT_NEAR(report.at("steps").get<double>(), 2970, 2);
  EXPECT_EQ(report.at("interrupts").at(0).at("name"), "IRQ 29");
  EXPECT_EQ(report.at("images").at(0).at("static_ram_bytes"), 256);

  std::istringstream trace(contents(file("pins.csv")));
  std::string header, first, second;
  std::getline(trace, header);
  std::getline(trace, first);
  std::getline(trace, second);
  EXPECT_EQ(header, "time_ns,signal,value");
  EXPECT_THAT(first, HasSubstr(",STEP,1"));
  EXPECT_THAT(second, HasSubstr(",STEP,0"));
}

TEST_F(Program, FlashIsKeptBetweenRunsAndPowerComesBackAfterACut) {
  const std::string flash = file("board.flash");
  const Outcome cut = call(image("flashing.bin") + " --seconds 0.2 --power-cut 1 --flash " + flash);
  ASSERT_EQ(cut.code, 0) << cut.err;
  EXPECT_THAT(cut.err, HasSubstr("power cut at 0.0"));
  ASSERT_EQ(contents(flash).size(), 1024U * 1024);
  EXPECT_EQ(contents(flash).substr(0x8000, 4), "\xff\xff\xff\xff") << "not yet programmed";

  const Outcome whole = call(image("flashing.bin") + " --seconds 0.6 --flash " + flash);
  ASSERT_EQ(whole.code, 0) << whole.err;
  EXPECT_EQ(contents(flash).substr(0x8004, 2), std::string("\x01\x00", 2));
}

TEST_F(Program, RefusesBadInputWithPlaceAndRemedy) {
  const Outcome missing = call("no-such.bin --seconds 1");
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.err, HasSubstr("no-such.bin: cannot be opened"));
  const Outcome address = call(image("steps.bin") + "@0x080fffff --seconds 1");
  EXPECT_EQ(address.code, 2);
  EXPECT_THAT(address.err, HasSubstr("do not fit"));
  const Outcome foreign = call("/proc/self/exe --seconds 1");
  EXPECT_EQ(foreign.code, 2);
  EXPECT_THAT(foreign.err, HasSubstr("not for a 32-bit ARM"));
  const Outcome limit = call(image("steps.bin") + " --seconds 1 --limit-at 2:left");
  EXPECT_EQ(limit.code, 2);
  EXPECT_THAT(limit.err, HasSubstr("2.5:home"));
  for (const char* span : {"4..2.5", "2..", "x", "-1", "2.5..4s", "nan"}) {
    const Outcome estop = call(image("steps.bin") + " --seconds 1 --estop-at=" + span);
    EXPECT_EQ(estop.code, 2) << span;
    EXPECT_THAT(estop.err, HasSubstr("2.5..4")) << span;
  }
  EXPECT_EQ(call("--help").code, 0);
}

TEST_F(Program, TheReportTellsWhatIsUsedOfHowMuch) {
  const Outcome outcome = call(image("steps.elf") + " --seconds 0.01 --report");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("of 1048576 bytes of flash, 256 of 131072 bytes of RAM"));
}

TEST_F(Program, InputsActAtTheirTimes) {
  const std::string firmware = DIASTOLE_SOURCE_DIR "/build/firmware/bin/diastole-stm32f405.elf";
  if (!std::filesystem::exists(firmware))
    GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
  const Outcome outcome = call(
      firmware + " --seconds 0.3 --estop-at 0.2..0.25 --limit-at 0.1..0.15:far --pins " + file("pins.csv"));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(contents(file("pins.csv")),
              testing::MatchesRegex("time_ns,signal,value\n20000[0-9]+,FAULT,1\n"))
      << "a limit at rest is no fault, the e-stop always is";
}

TEST_F(Program, ALockedUpCoreIsANegativeAnswer) {
  const Outcome outcome = call(image("double_fault.elf") + " --seconds 0.01 --report");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.out, HasSubstr("locked up"));
}

}  // namespace
}  // namespace diastole::sim_board_test
