// Modbus RTU over a pair of 16550s that are joined by a cable, which, unlike a pseudo-terminal, keep parity
// and rate.

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <modbus/modbus.h>
#include <termios.h>
#include <unistd.h>

#include <thread>

#include "host/daq/driver.hpp"
#include "host/transport/descriptor.hpp"
#include "host/transport/serial_port.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/daq/configured.hpp"

namespace diastole::vm {
namespace {

constexpr const char* left = "/dev/ttyS4";
constexpr const char* right = "/dev/ttyS5";

/// libmodbus's own server at the right end.
class Server {
 public:
  explicit Server(char parity) : context_(modbus_new_rtu(right, 115200, parity, 8, 1)) {
    modbus_set_slave(context_, 1);
    registers_ = modbus_mapping_new(0, 0, 16, 0);
    registers_->tab_registers[3] = 1234;
    modbus_set_indication_timeout(context_, 0, 100'000);
    if (modbus_connect(context_) != 0) throw std::runtime_error("the right end cannot be opened");
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        std::array<uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> query{};
        const int length = modbus_receive(context_, query.data());
        if (length > 0) modbus_reply(context_, query.data(), length, registers_);
        if (length < 0) modbus_flush(context_);
      }
    });
  }
  ~Server() {
    thread_.request_stop();
    thread_.join();
    modbus_mapping_free(registers_);
    modbus_close(context_);
    modbus_free(context_);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

 private:
  modbus_t* context_;
  modbus_mapping_t* registers_;
  std::jthread thread_;
};

daq::OpenPolled rtu(const std::string& parity) {
  return daq::configured(daq::modbus_rtu_driver.configure,
                         fmt::format("port = \"{}\"\nparity = \"{}\"\ntimeout_ms = 400\n", left, parity),
                         "[[daq.channel]]\nregister = 3\ntype = \"uint16\"\nV_per_count = 0.001\n");
}

class Parity : public testing::TestWithParam<std::pair<const char*, char>> {};

TEST_P(Parity, ReadsWhereBothEndsAgree) {
  const Server server(GetParam().second);
  const auto instrument = rtu(GetParam().first)({});
  std::vector<double> volts(1);
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(instrument->read(volts).ok) << i;
    ASSERT_NEAR(volts[0], 1.234, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Serial, Parity,
                         testing::Values(std::pair{"even", 'E'}, std::pair{"odd", 'O'},
                                         std::pair{"none", 'N'}));

TEST(Serial, ParityAndStopBitsAreThePortsNow) {
  const Server server('O');
  const auto instrument = rtu("odd")({});
  const Descriptor port(::open(left, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios settings{};
  ASSERT_EQ(tcgetattr(port.get(), &settings), 0);
  EXPECT_TRUE(settings.c_cflag & PARENB);
  EXPECT_TRUE(settings.c_cflag & PARODD);
  EXPECT_FALSE(settings.c_cflag & CSTOPB);
  EXPECT_EQ(cfgetospeed(&settings), static_cast<speed_t>(B115200));
}

TEST(Serial, AnotherProgramCannotOpenThePortOfTheDaemon) {
  const SerialPort port(left, 460800);
  EXPECT_THROW(SerialPort(left, 460800), HardwareError);
}

TEST(Serial, BytesCrossTheCableBothWays) {
  SerialPort here(left, 460800);
  SerialPort there(right, 460800);
  std::vector<uint8_t> sent(4096);
  for (size_t i = 0; i < sent.size(); ++i)
    sent[i] = static_cast<uint8_t>(i * 7);
  here.write(sent);
  std::vector<uint8_t> got;
  std::array<uint8_t, 512> block{};
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
       got.size() < sent.size() && std::chrono::steady_clock::now() < end;) {
    here.flush(10);
    there.wait_received(got.size() + 1, 50);
    const size_t count = there.read(block);
    got.insert(got.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(count));
  }
  EXPECT_EQ(got, sent);
}

}  // namespace
}  // namespace diastole::vm
