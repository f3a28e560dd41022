// Our drivers against a server that shares no code with them (pymodbus_server.py).

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "host/transport/descriptor.hpp"
#include "tests/host/daq/configured.hpp"
#include "tests/host/daq/pseudo_terminal.hpp"

namespace diastole::daq {
namespace {

const char* const python = "/usr/bin/python3";  // the system's, which has the packages

class Pymodbus {
 public:
  explicit Pymodbus(const std::vector<std::string>& arguments) {
    std::array<int, 2> ends{};
    (void)!::pipe(ends.data());
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(ends[1], STDOUT_FILENO);
      ::close(ends[0]);
      const std::string script = std::string(DIASTOLE_SOURCE_DIR) + "/tests/host/daq/pymodbus_server.py";
      std::vector<const char*> words{python, script.c_str()};
      for (const std::string& argument : arguments)
        words.push_back(argument.c_str());
      words.push_back(nullptr);
      ::execv(python, const_cast<char* const*>(words.data()));
      ::_exit(127);
    }
    ::close(ends[1]);
    const std::unique_ptr<FILE, int (*)(FILE*)> out(::fdopen(ends[0], "r"), &std::fclose);
    std::array<char, 128> line{};
    if (std::fgets(line.data(), line.size(), out.get()) != nullptr) ready_ = line.data();
    if (!ready_.empty()) ready_.pop_back();
  }
  ~Pymodbus() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Pymodbus(const Pymodbus&) = delete;
  Pymodbus& operator=(const Pymodbus&) = delete;

  /// What it printed when it was ready; empty when it could not start.
  [[nodiscard]] const std::string& ready() const { return ready_; }

 private:
  pid_t pid_ = -1;
  std::string ready_;
};

bool pymodbus_is_there() {
  return std::system((std::string(python) + " -c 'import pymodbus, serial_asyncio' 2>/dev/null").c_str()) ==
         0;
}

/// The preset, with its timer through the wrap, over whatever line.
void expect_labjack(PolledInstrument& instrument) {
  std::vector<double> volts(3);
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(instrument.read(volts).ok);
    EXPECT_THAT(volts, testing::ElementsAre(0.25, 3.25, 13.25));
  }
  EXPECT_DOUBLE_EQ(instrument.timer_rate_Hz(), 40e6);
  const auto first = instrument.read_timer();
  const auto second = instrument.read_timer();
  ASSERT_TRUE(first && second);
  EXPECT_LT(*second, *first) << "the counter wraps between the two";
  EXPECT_EQ(*second - *first, 40'000'000U);
}

constexpr const char* inputs =
    "[[daq.channel]]\ninput = 0\n[[daq.channel]]\ninput = 3\n[[daq.channel]]\ninput = 13\n";
constexpr const char* described =
    "[[daq.channel]]\nregister = 100\ntype = \"uint16\"\nV_per_count = 0.001\n"
    "[[daq.channel]]\nregister = 101\ntype = \"int16\"\nV_per_count = 0.001\n";

void expect_described(PolledInstrument& instrument) {
  std::vector<double> volts(2);
  ASSERT_TRUE(instrument.read(volts).ok);
  EXPECT_NEAR(volts[0], 1.234, 1e-12);
  EXPECT_NEAR(volts[1], -1.234, 1e-12);
}

TEST(Pymodbus, OverTcp) {
  if (!pymodbus_is_there()) GTEST_SKIP() << "python3-pymodbus or python3-serial-asyncio is not installed";
  const Pymodbus server({"tcp"});
  ASSERT_FALSE(server.ready().empty());
  const std::string where = fmt::format("host = \"127.0.0.1\"\nport = {}\n", server.ready());
  expect_labjack(
      *configured(modbus_tcp_driver.configure, where + "preset = \"labjack-t\"\n", inputs)(patient));
  for (const char* function : {"holding", "input"}) {
    expect_described(*configured(modbus_tcp_driver.configure,
                                 where + fmt::format("function = \"{}\"\n", function), described)(patient));
  }
}

TEST(Pymodbus, OverASerialLine) {
  if (!pymodbus_is_there()) GTEST_SKIP() << "python3-pymodbus or python3-serial-asyncio is not installed";
  const NullModem cable;
  const Pymodbus server({"rtu", cable.right()});
  ASSERT_FALSE(server.ready().empty());
  const std::string where = fmt::format("port = \"{}\"\nparity = \"none\"\ntimeout_ms = 500\n", cable.left());
  expect_labjack(
      *configured(modbus_rtu_driver.configure, where + "preset = \"labjack-t\"\n", inputs)(patient));
  expect_described(*configured(modbus_rtu_driver.configure, where, described)(patient));
}

}  // namespace
}  // namespace diastole::daq
