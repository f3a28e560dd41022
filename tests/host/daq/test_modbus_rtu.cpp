#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <atomic>
#include <bit>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/host/daq/configured.hpp"
#include "tests/host/daq/pseudo_terminal.hpp"

namespace diastole::daq {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

uint16_t crc16(std::span<const uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc & 1U) != 0 ? crc >> 1U ^ 0xA001U : crc >> 1U;
  }
  return static_cast<uint16_t>(crc);
}

/// An instrument of two registers that answers question n with the float n, as it is told.
class RtuInstrument {
 public:
  enum class Mishap { none, silent, late, corrupted, exception };

  explicit RtuInstrument(std::function<Mishap(int question)> mishap = [](int) { return Mishap::none; })
      : mishap_(std::move(mishap)), thread_([this](const std::stop_token& stop) { serve(stop); }) {}

  [[nodiscard]] const std::string& port() const { return terminal_.path(); }
  [[nodiscard]] int questions() const { return questions_; }

 private:
  void serve(const std::stop_token& stop) {
    std::vector<uint8_t> query;
    while (!stop.stop_requested()) {
      for (const uint8_t byte : terminal_.receive(10ms))
        query.push_back(byte);
      if (query.size() < 8) continue;
      answer(questions_++);
      query.clear();
    }
  }

  void answer(int question) {
    const Mishap mishap = mishap_(question);
    if (mishap == Mishap::silent) return;
    if (mishap == Mishap::late) std::this_thread::sleep_for(450ms);
    const auto bits = std::bit_cast<uint32_t>(static_cast<float>(question));
    std::vector<uint8_t> reply{1, 3, 4};
    for (const unsigned shift : {24U, 16U, 8U, 0U})
      reply.push_back(static_cast<uint8_t>(bits >> shift));
    if (mishap == Mishap::exception) reply = {1, 0x83, 6};  // busy
    const uint16_t crc = crc16(reply);
    reply.push_back(static_cast<uint8_t>(crc));
    reply.push_back(static_cast<uint8_t>(crc >> 8U));
    if (mishap == Mishap::corrupted) reply[4] ^= 0x10;
    terminal_.send(reply);
  }

  PseudoTerminal terminal_;
  std::function<Mishap(int)> mishap_;
  std::atomic<int> questions_ = 0;
  std::jthread thread_;
};

OpenPolled rtu(const std::string& port, const std::string& more = "parity = \"none\"\ntimeout_ms = 1000\n") {
  return configured(modbus_rtu_driver.configure, fmt::format("port = \"{}\"\n", port) + more,
                    "[[daq.channel]]\nregister = 0\ntype = \"float32\"\n");
}

TEST(ModbusRtu, ReadsWhatTheInstrumentSends) {
  const RtuInstrument instrument;
  const auto opened = rtu(instrument.port())({});
  std::vector<double> volts(1);
  for (int reading = 1; reading < 20; ++reading) {  // question 0 asked whether it is there
    ASSERT_TRUE(opened->read(volts).ok);
    EXPECT_DOUBLE_EQ(volts[0], reading);
  }
}

std::string name_of(RtuInstrument::Mishap mishap) {
  constexpr std::array names{"none", "silent", "late", "corrupted", "exception"};
  return names[static_cast<size_t>(mishap)];
}

class RtuMishap : public testing::TestWithParam<RtuInstrument::Mishap> {};

TEST_P(RtuMishap, NeverShiftsALaterAnswer) {
  const RtuInstrument instrument(
      [](int question) { return question == 3 ? GetParam() : RtuInstrument::Mishap::none; });
  const auto opened = rtu(instrument.port(), "parity = \"none\"\ntimeout_ms = 300\n")({});
  std::vector<double> volts(1);
  int failed = 0;
  double last = 0;
  for (const auto end = std::chrono::steady_clock::now() + 20s;
       last < 8 && std::chrono::steady_clock::now() < end;) {
    const int asked = instrument.questions();
    const Outcome outcome = opened->read(volts);
    if (!outcome.ok) {
      ++failed;
      EXPECT_THAT(outcome.fault, Not(IsEmpty()));
      std::this_thread::sleep_for(3ms);
      continue;
    }
    EXPECT_DOUBLE_EQ(volts[0], asked) << "an answer to another question";
    EXPECT_NE(volts[0], 3);
    last = volts[0];
  }
  EXPECT_GE(failed, 1);
  EXPECT_GE(last, 8) << "it did not come back";
}

INSTANTIATE_TEST_SUITE_P(ModbusRtu, RtuMishap,
                         testing::Values(RtuInstrument::Mishap::silent, RtuInstrument::Mishap::late,
                                         RtuInstrument::Mishap::corrupted, RtuInstrument::Mishap::exception),
                         [](const auto& each) { return name_of(each.param); });

TEST(ModbusRtu, SaysInNumbersWhatTheLineCannotCarry) {
  const RtuInstrument instrument;
  const auto opened = rtu(instrument.port())({});
  const RatePlan fast = opened->plan_rate(300);
  EXPECT_DOUBLE_EQ(fast.rate_Hz, 300);
  // 17 characters of 10 bits at 115200 baud and twice 1.75 ms of silence: 4.98 ms.
  EXPECT_THAT(fast.warning, AllOf(HasSubstr("5.0 ms"), HasSubstr("115200 baud"), HasSubstr("201 samples"),
                                  HasSubstr("300"), HasSubstr("33 %"), HasSubstr("sample_rate_Hz = 200")));
  EXPECT_THAT(opened->plan_rate(200).warning, IsEmpty());
}

TEST(ModbusRtu, AFasterLineCarriesMore) {
  const RtuInstrument instrument;
  const auto opened = rtu(instrument.port(), "parity = \"none\"\nbaud = 921600\n")({});
  EXPECT_THAT(opened->plan_rate(250).warning, IsEmpty());
  EXPECT_THAT(opened->plan_rate(1000).warning, HasSubstr("921600"));
}

TEST(ModbusRtu, AnAbsentPortOrASilentInstrumentIsAHardwareError) {
  EXPECT_THAT(message_of<HardwareError>([] { rtu("/dev/no-such-port")({}); }),
              AllOf(HasSubstr("/dev/no-such-port"), HasSubstr("cannot be opened")));
  const PseudoTerminal nobody;
  EXPECT_THAT(message_of<HardwareError>([&] { rtu(nobody.path(), "timeout_ms = 60\n")({}); }),
              AllOf(HasSubstr(nobody.path()), HasSubstr("no answer within 60 ms"), HasSubstr("parity")));
}

TEST(ModbusRtu, ABaudRateThatSerialPortsDoNotKnowIsRefused) {
  EXPECT_THAT(message_of<InputError>([] { rtu("/dev/ttyUSB0", "baud = 100000\n"); }),
              AllOf(HasSubstr("daq.baud"), HasSubstr("100000")));
}

TEST(ModbusRtu, APortGivenAtStartReplacesTheFiles) {
  const RtuInstrument instrument;
  const auto opened = rtu("/dev/no-such-port")({.address = instrument.port()});
  EXPECT_THAT(opened->describe(), HasSubstr(instrument.port()));
}

}  // namespace
}  // namespace diastole::daq
