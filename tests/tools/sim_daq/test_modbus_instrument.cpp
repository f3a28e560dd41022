#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <memory>
#include <thread>

#include "protocol/contract/input_error.hpp"
#include "tools/sim_daq/modbus_instrument.hpp"

namespace diastole::sim_daq {
namespace {

/// The instrument served from a thread, on a clock that the test sets; a libmodbus client beside it.
class Served {
 public:
  explicit Served(const InstrumentConfig& config = {})
      : instrument_(config, {[this] { return now_ns.load(); }, [this](int channel) { return volts(channel); },
                             [this] { return fails.load(); }}),
        client_(modbus_new_tcp("127.0.0.1", instrument_.port()), modbus_free),
        thread_([this] { serve(); }) {
    be_patient();
    EXPECT_EQ(modbus_connect(client_.get()), 0);
  }
  ~Served() {
    stop_ = true;
    thread_.join();
    modbus_close(client_.get());
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  [[nodiscard]] double volts(int channel) const {
    return 0.25 * channel + static_cast<double>(now_ns.load()) * 1e-9;
  }
  [[nodiscard]] modbus_t* client() const { return client_.get(); }
  /// For an answer that must come, however busy the machine is.
  void be_patient() const { modbus_set_response_timeout(client_.get(), 10, 0); }
  /// For one that must not come.
  void be_impatient() const { modbus_set_response_timeout(client_.get(), 0, 100'000); }

  std::atomic<uint64_t> now_ns{0};
  std::atomic<bool> fails{false};

 private:
  void serve() {
    while (!stop_) {
      std::vector<pollfd> waiting;
      for (const int fd : instrument_.descriptors())
        waiting.push_back({fd, POLLIN, 0});
      ::poll(waiting.data(), waiting.size(), 2);
      instrument_.service();
    }
  }

  ModbusInstrument instrument_;
  std::unique_ptr<modbus_t, decltype(&modbus_free)> client_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

using Two = std::array<uint16_t, 2>;

float as_float(uint16_t high, uint16_t low) {
  return std::bit_cast<float>(static_cast<uint32_t>(high) << 16 | low);
}

uint32_t as_u32(const Two& registers) { return uint32_t{registers[0]} << 16 | registers[1]; }

TEST(ModbusInstrument, ReadsVoltsAsFloatsFromBothKindsOfRegister) {
  Served served;
  served.now_ns = 2'000'000'000;
  std::array<uint16_t, 6> registers{};
  ASSERT_EQ(modbus_read_registers(served.client(), 0, 6, registers.data()), 6);
  EXPECT_FLOAT_EQ(as_float(registers[0], registers[1]), 2.0F);
  EXPECT_FLOAT_EQ(as_float(registers[4], registers[5]), 2.5F);
  Two input{};
  ASSERT_EQ(modbus_read_input_registers(served.client(), 4, 2, input.data()), 2);
  EXPECT_FLOAT_EQ(as_float(input[0], input[1]), 2.5F);
}

TEST(ModbusInstrument, TestRegisterAndCoreTimerAreTheLabJacks) {
  InstrumentConfig config;
  config.clock_error_ppm = 50;
  Served served(config);
  Two registers{};
  ASSERT_EQ(modbus_read_registers(served.client(), 55100, 2, registers.data()), 2);
  EXPECT_EQ(as_u32(registers), 0x00112233U);
  served.now_ns = 1'000'000'000;
  ASSERT_EQ(modbus_read_registers(served.client(), 61520, 2, registers.data()), 2);
  EXPECT_EQ(as_u32(registers), 40'002'000U);
  served.now_ns = 200'000'000'000;  // the 32-bit counter has wrapped
  ASSERT_EQ(modbus_read_registers(served.client(), 61520, 2, registers.data()), 2);
  EXPECT_EQ(as_u32(registers), static_cast<uint32_t>(200 * 40'002'000ULL));
}

TEST(ModbusInstrument, AnUnknownAddressIsRefused) {
  Served served;
  Two registers{};
  EXPECT_EQ(modbus_read_registers(served.client(), 40000, 2, registers.data()), -1);
  EXPECT_EQ(errno, EMBXILADD);
}

TEST(ModbusInstrument, StallSwallowsRequestsOnlyInItsWindow) {
  InstrumentConfig config;
  config.faults.stall = {1000, 2000};
  Served served(config);
  Two registers{};
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), 2);
  served.now_ns = 1000;
  served.be_impatient();
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), -1);
  EXPECT_EQ(errno, ETIMEDOUT);
  served.now_ns = 2000;
  served.be_patient();
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), 2);
}

TEST(ModbusInstrument, DropClosesTheConnectionAndLaterTakesANewOne) {
  InstrumentConfig config;
  config.faults.drop = {1000, 2000};
  Served served(config);
  served.now_ns = 1000;
  Two registers{};
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), -1);
  modbus_close(served.client());
  served.now_ns = 2000;
  ASSERT_EQ(modbus_connect(served.client()), 0);
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), 2);
}

TEST(ModbusInstrument, ADelayedReplyComesWhenItIsDue) {
  InstrumentConfig config;
  config.faults.delay = {1000, 2000};
  config.faults.delay_ns = 5000;
  Served served(config);
  served.now_ns = 1000;
  Two registers{};
  served.be_impatient();
  EXPECT_EQ(modbus_read_registers(served.client(), 55100, 2, registers.data()), -1);
  served.now_ns = 6000;
  served.be_patient();
  std::array<uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> late{};
  EXPECT_GT(modbus_receive_confirmation(served.client(), late.data()), 0);
}

TEST(ModbusInstrument, ABusyPortIsAHardwareErrorWithARemedy) {
  const InstrumentInputs nothing{[] { return uint64_t{0}; }, [](int) { return 0.0; }};
  ModbusInstrument first({}, nothing);
  InstrumentConfig same;
  same.port = first.port();
  try {
    ModbusInstrument second(same, nothing);
    FAIL() << "two instruments share a port";
  } catch (const HardwareError& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(first.port())), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("another port"), std::string::npos);
  }
}

TEST(ModbusInstrument, ARefusedReadingIsAnExceptionAndTheNextOneIsWell) {
  Served served;
  Two registers{};
  served.fails = true;
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), -1);
  EXPECT_EQ(errno, EMBXGTAR);
  EXPECT_EQ(modbus_read_registers(served.client(), 55100, 2, registers.data()), 2) << "only the inputs fail";
  served.fails = false;
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), 2);
}

TEST(ModbusInstrument, AnAnswerThatBreaksOffIsAnError) {
  InstrumentConfig config;
  config.faults.cut_short = true;
  Served served(config);
  Two registers{};
  EXPECT_EQ(modbus_read_registers(served.client(), 0, 2, registers.data()), -1);
}

TEST(ModbusInstrument, AStuckReadingStaysAndATimerMayJump) {
  InstrumentConfig config;
  config.faults.stuck = true;
  config.faults.timer_ahead_s = 0.5;
  Served served(config);
  served.now_ns = 1'000'000'000;
  Two registers{};
  ASSERT_EQ(modbus_read_registers(served.client(), 2, 2, registers.data()), 2);
  EXPECT_EQ(as_float(registers[0], registers[1]), 0.0F);
  ASSERT_EQ(modbus_read_registers(served.client(), 61520, 2, registers.data()), 2);
  EXPECT_EQ(as_u32(registers), 60'000'000U);
}

}  // namespace
}  // namespace diastole::sim_daq
