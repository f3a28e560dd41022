#include <fmt/format.h>
#include <gmock/gmock.h>

#include "host/daq/driver.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/host/daq/configured.hpp"
#include "tests/host/daq/modbus_server.hpp"

namespace diastole::daq {
namespace {

using testing::AllOf;
using testing::HasSubstr;

OpenPolled configured(const std::string& daq, const std::string& channels) {
  return configured(modbus_tcp_driver.configure, daq, channels);
}

constexpr const char* two_inputs = "[[daq.channel]]\ninput = 0\n[[daq.channel]]\ninput = 3\n";

std::string labjack(int port) {
  return fmt::format("host = \"127.0.0.1\"\nport = {}\npreset = \"labjack-t\"\n", port);
}

TEST(ModbusTcp, ReadsAllChannelsInOneRequestAndTheTimer) {
  const ModbusServer server;
  const auto instrument = configured(labjack(server.port()), two_inputs)(patient);
  ASSERT_EQ(instrument->channels(), 2U);
  std::vector<double> volts(2);
  ASSERT_TRUE(instrument->read(volts).ok);
  EXPECT_NEAR(volts[0], 1, 1e-6);  // request 0 was the identity
  EXPECT_NEAR(volts[1], 1.3, 1e-6);
  EXPECT_EQ(instrument->read_timer(), 0x00010002U);
  EXPECT_DOUBLE_EQ(instrument->timer_rate_Hz(), 40e6);
}

TEST(ModbusTcp, ADescribedRegisterMapIsScaled) {
  const ModbusServer server;
  const auto instrument =
      configured(fmt::format("host = \"127.0.0.1\"\nport = {}\n", server.port()),
                 "[[daq.channel]]\nregister = 100\ntype = \"uint16\"\nV_per_count = 0.001\n"
                 "[[daq.channel]]\nregister = 101\ntype = \"int16\"\nV_per_count = 0.001\n")(patient);
  std::vector<double> volts(2);
  ASSERT_TRUE(instrument->read(volts).ok);
  EXPECT_NEAR(volts[0], 1, 1e-9);
  EXPECT_NEAR(volts[1], -1, 1e-9);
  EXPECT_FALSE(instrument->read_timer());
}

TEST(ModbusTcp, ALateAnswerIsNeverTakenForTheNext) {
  // Request 3 is answered after 150 ms, when the driver (timeout 60 ms) has long given up.
  const ModbusServer server([](int request) { return request == 3 ? 150 : 0; });
  const auto instrument = configured(labjack(server.port()), two_inputs)(patient);
  std::vector<double> volts(2);
  int failed = 0;
  double last = -1;
  for (int i = 0; i < 12; ++i) {
    const Outcome outcome = instrument->read(volts);
    if (!outcome.ok) {
      ++failed;
      EXPECT_THAT(outcome.fault, HasSubstr("60 ms"));
      continue;
    }
    EXPECT_GT(volts[0], last) << "an answer came twice or out of turn";
    EXPECT_NE(volts[0], 3) << "the late answer was taken for a new one";
    last = volts[0];
  }
  EXPECT_GE(failed, 1);
  EXPECT_GT(last, 3);
  EXPECT_GE(server.connections(), 2);
}

TEST(ModbusTcp, AStallAndAHangUpAreToldAndOvercome) {
  using Mishap = ModbusServer::Mishap;
  const ModbusServer server(
      [](int) { return 0; },
      [](int request) {
        return request == 2 ? Mishap::stall : request == 4 ? Mishap::hang_up : Mishap::none;
      });
  const auto instrument = configured(labjack(server.port()), two_inputs)(patient);
  std::vector<double> volts(2);
  std::vector<bool> ok;
  for (int i = 0; i < 5; ++i)
    ok.push_back(instrument->read(volts).ok);
  EXPECT_THAT(ok, testing::ElementsAre(true, false, true, false, true));
}

TEST(ModbusTcp, NobodyThereOrAnotherInstrumentIsAHardwareError) {
  int dead_port = 0;
  {
    const ModbusServer server;
    dead_port = server.port();
  }
  EXPECT_THAT(message_of<HardwareError>([&] { configured(labjack(dead_port), two_inputs)({}); }),
              AllOf(HasSubstr(std::to_string(dead_port)), HasSubstr("does not connect")));
}

TEST(ModbusTcp, PatienceBeyondASecondIsRefusedWithWhatIsAllowed) {
  const auto with_timeout = [](int timeout_ms) {
    return configured(fmt::format("host = \"h\"\npreset = \"labjack-t\"\ntimeout_ms = {}\n", timeout_ms),
                      two_inputs);
  };
  EXPECT_NO_THROW(with_timeout(most_timeout_ms));
  EXPECT_THAT(message_of<InputError>([&] { with_timeout(2000); }),
              AllOf(HasSubstr("daq.timeout_ms"), HasSubstr("2000"), HasSubstr("at most 1000")));
}

TEST(ModbusTcp, ANameIsLookedUpAtTheStart) {
  const ModbusServer server;
  const auto by_name = [&](const std::string& host) {
    return configured(fmt::format("host = \"{}\"\nport = {}\n", host, server.port()),
                      "[[daq.channel]]\nregister = 0\ntype = \"float32\"\n")(patient);
  };
  std::vector<double> volts(1);
  EXPECT_TRUE(by_name("localhost")->read(volts).ok);
  EXPECT_THAT(message_of<HardwareError>([&] { by_name("no host"); }),
              AllOf(HasSubstr("no host"), HasSubstr("can be found")));
}

TEST(ModbusTcp, ALostInstrumentsClockIsNotAskedFor) {
  const ModbusServer server(
      [](int) { return 0; },
      [](int request) { return request == 1 ? ModbusServer::Mishap::hang_up : ModbusServer::Mishap::none; });
  const auto instrument = configured(labjack(server.port()), two_inputs)(patient);
  std::vector<double> volts(2);
  EXPECT_FALSE(instrument->read(volts).ok);
  EXPECT_FALSE(instrument->read_timer()) << "it would have to connect, a second time in one turn of the loop";
  EXPECT_EQ(server.connections(), 1);
  EXPECT_TRUE(instrument->read(volts).ok);
  EXPECT_TRUE(instrument->read_timer());
}

TEST(ModbusTcp, AnAddressGivenAtStartReplacesTheFiles) {
  const ModbusServer server;
  const auto open = configured(labjack(1), two_inputs);
  const auto instrument = open({.address = fmt::format("127.0.0.1:{}", server.port())});
  EXPECT_THAT(instrument->describe(), HasSubstr(std::to_string(server.port())));
  EXPECT_THROW(open({.address = "nonsense"}), InputError);
}

}  // namespace
}  // namespace diastole::daq
