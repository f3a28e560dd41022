#include "host/transport/serial_port.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <stdlib.h>

#include <array>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

struct Pty {
  Descriptor master{::posix_openpt(O_RDWR | O_NOCTTY)};
  std::string name;
  Pty() {
    EXPECT_EQ(::grantpt(master.get()), 0);
    EXPECT_EQ(::unlockpt(master.get()), 0);
    std::array<char, 64> buffer{};
    EXPECT_EQ(::ptsname_r(master.get(), buffer.data(), buffer.size()), 0);
    name = buffer.data();
  }
};

TEST(SerialPort, CarriesEveryByteValueBothWaysAndCounts) {
  Pty pty;
  SerialPort port(pty.name, 460800);
  std::array<uint8_t, 256> all{};
  for (size_t i = 0; i < all.size(); ++i)
    all[i] = static_cast<uint8_t>(i);
  port.write(all);
  port.flush(1000);
  EXPECT_EQ(port.written_total(), 256U);
  std::array<uint8_t, 256> at_master{};
  EXPECT_EQ(::read(pty.master.get(), at_master.data(), at_master.size()), 256);
  EXPECT_EQ(at_master, all);
  ASSERT_EQ(::write(pty.master.get(), all.data(), all.size()), 256);
  port.wait_received(256, 1000);
  EXPECT_EQ(port.received_total(), 256U);
  std::array<uint8_t, 300> back{};
  EXPECT_EQ(port.read(back), 256U);
  EXPECT_TRUE(std::equal(all.begin(), all.end(), back.begin()));
  EXPECT_FALSE(port.lost());
}

TEST(SerialPort, ABusyPortIsRefusedInPlainWords) {
  Pty pty;
  const SerialPort port(pty.name, 115200);
  EXPECT_THAT(message_of<HardwareError>([&] { SerialPort second(pty.name, 115200); }), HasSubstr("in use"));
}

TEST(SerialPort, AHangUpIsSeenAndTheNameCanBeOpenedAgain) {
  auto pty = std::make_unique<Pty>();
  SerialPort port(pty->name, 115200);
  pty.reset();
  std::array<uint8_t, 8> buffer{};
  EXPECT_EQ(port.read(buffer), 0U);
  EXPECT_TRUE(port.lost());
  port.write(buffer);  // no effect, no signal
}

TEST(SerialPort, AbsentPortsAndStrangeRatesAreRefused) {
  EXPECT_THAT(message_of<HardwareError>([] { SerialPort port("/dev/no-such-port", 115200); }),
              HasSubstr("no such serial port"));
  Pty pty;
  EXPECT_THAT(message_of<HardwareError>([&] { SerialPort port(pty.name, 12345); }), HasSubstr("12345"));
  EXPECT_THAT(message_of<HardwareError>([] { SerialPort port("/dev/null", 115200); }),
              HasSubstr("not a serial port"));
}

}  // namespace
}  // namespace diastole
