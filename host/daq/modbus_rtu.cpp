// Modbus RTU over a serial port (RS-232, RS-485).
//
//   [daq]
//   driver = "modbus-rtu"
//   port = "/dev/ttyUSB0"
//   baud = 115200
//   parity = "even"                 # "even" as the standard has it, "odd", "none"
//   stop_bits = 1
//   timeout_ms = 50
//   ...                             # registers: modbus_registers.hpp
//
// One reading of n registers takes on the line
//
//   request   unit  function  first(2)  count(2)  crc(2)          8 characters
//   response  unit  function  bytes     n x 2     crc(2)      5 + 2n characters
//   and before each of the two a silence of 3.5 characters, 1.75 ms above 19200 baud,
//
// a character being start, 8 data, parity and stop bits: at 115200 baud and two registers 5 ms. A 300 Hz
// session needs 3.3 ms; plan_rate() says so.
//
// An answer carries no number of its question. After a failure an answer may still be on its way: the line is
// left alone, and what arrives is thrown away, until it has been silent for as long as an answer may take.

#include <fmt/format.h>
#include <modbus/modbus.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>

#include "host/daq/driver.hpp"
#include "host/daq/modbus_registers.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::daq {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// What libmodbus can set; it takes 9600 for anything else.
constexpr std::array rates{1200,    2400,    4800,    9600,    19200,   38400,  57600,
                           115200,  230400,  460800,  500000,  576000,  921600, 1000000,
                           1152000, 1500000, 2500000, 3000000, 3500000, 4000000};

struct SerialLine {
  std::string port;
  int baud = 115200;
  char parity = 'E';
  int stop_bits = 1;
  int timeout_ms = 50;

  [[nodiscard]] double character_s() const {
    return (1 + 8 + (parity == 'N' ? 0 : 1) + stop_bits) / static_cast<double>(baud);
  }
  [[nodiscard]] double silence_s() const { return baud > 19200 ? 1.75e-3 : 3.5 * character_s(); }
  [[nodiscard]] double reading_s(int registers) const {
    return (8 + 5 + 2 * registers) * character_s() + 2 * silence_s();
  }
};

class RtuLine final : public ModbusLine {
 public:
  RtuLine(SerialLine line, int unit) : line_(std::move(line)), unit_(unit) {
    if (const std::string fault = open(); !fault.empty()) throw HardwareError(describe(), fault, remedy());
  }

  [[nodiscard]] std::string describe() const override {
    return fmt::format("modbus-rtu at {} ({} baud, 8{}{})", line_.port, line_.baud, line_.parity,
                       line_.stop_bits);
  }
  [[nodiscard]] std::string remedy() const override {
    return "Check cable and power, and port, baud, parity, stop_bits and unit in [daq].";
  }
  [[nodiscard]] bool ready() const override { return context_ != nullptr && !settling_; }

  [[nodiscard]] RatePlan plan_rate(double asked_Hz, int registers) const override {
    const double most_Hz = 1 / line_.reading_s(registers);
    if (asked_Hz <= most_Hz) return {asked_Hz, {}};
    return {asked_Hz, fmt::format("a reading of {} registers takes {:.1f} ms at {} baud: the line carries "
                                  "{:.0f} samples a second, {:g} are asked for, so that some {:.0f} % will "
                                  "be missing. Ask for sample_rate_Hz = {:.0f} or less, or use Modbus TCP",
                                  registers, 1e3 * line_.reading_s(registers), line_.baud, most_Hz, asked_Hz,
                                  100 * (1 - most_Hz / asked_Hz), std::floor(most_Hz / 10) * 10)};
  }

  std::string ask(bool input_function, int first, std::span<uint16_t> out) override {
    if (settling_ && !settled()) return *settling_;
    if (context_ == nullptr) {
      if (std::string fault = open(); !fault.empty()) return fault;
    }
    const auto read = input_function ? modbus_read_input_registers : modbus_read_registers;
    const int count = static_cast<int>(out.size());
    if (read(context_.get(), first, count, out.data()) == count) return {};
    const int error = errno;
    const std::string reason =
        error == ETIMEDOUT ? fmt::format("no answer within {} ms", line_.timeout_ms) : modbus_strerror(error);
    if (error > MODBUS_ENOBASE && error <= EMBXGTAR) return reason;  // an answer: the line is in step
    if (error == EIO || error == ENXIO || error == EBADF || error == ENODEV) context_.reset();
    settling_ = reason;
    quiet_since_ = SteadyClock::now();
    return reason;
  }

 private:
  /// Empty, or why the port cannot be used.
  std::string open() {
    context_.reset(modbus_new_rtu(line_.port.c_str(), line_.baud, line_.parity, 8, line_.stop_bits));
    if (context_ == nullptr) return "is not a port";
    modbus_set_slave(context_.get(), unit_);
    const auto timeout_us = static_cast<uint32_t>(line_.timeout_ms) * 1000;
    modbus_set_response_timeout(context_.get(), timeout_us / 1'000'000, timeout_us % 1'000'000);
    modbus_set_byte_timeout(context_.get(), 0, 0);  // the response's time-out is for all of its bytes
    if (modbus_connect(context_.get()) == 0) return {};
    const std::string reason = modbus_strerror(errno);
    context_.reset();
    return "cannot be opened: " + reason;
  }

  /// Throws away what has arrived; true once nothing has for as long as an answer may take.
  bool settled() {
    const auto now = SteadyClock::now();
    if (context_ != nullptr && modbus_flush(context_.get()) > 0) quiet_since_ = now;
    if (now - quiet_since_ < std::chrono::milliseconds(line_.timeout_ms)) return false;
    settling_.reset();
    return true;
  }

  SerialLine line_;
  int unit_;
  ModbusContext context_;
  std::optional<std::string> settling_;  ///< why the line must fall silent first
  SteadyClock::time_point quiet_since_;
};

SerialLine read_line(TableReader& daq) {
  SerialLine line;
  line.port = daq.text("port");
  line.baud = static_cast<int>(daq.integer_or("baud", line.baud));
  if (std::find(rates.begin(), rates.end(), line.baud) == rates.end()) {
    daq.fail("baud", fmt::format("{} is no rate of serial ports", line.baud),
             "Use what the instrument is set to, for example 9600, 19200, 115200 or 230400.");
  }
  const std::string parity = daq.has("parity") ? daq.choice("parity", {"even", "odd", "none"}) : "even";
  line.parity = parity == "even" ? 'E' : parity == "odd" ? 'O' : 'N';
  line.stop_bits = static_cast<int>(daq.integer_or("stop_bits", 1, {.at_least = 1, .at_most = 2}));
  line.timeout_ms = static_cast<int>(
      daq.integer_or("timeout_ms", line.timeout_ms, {.at_least = 1, .at_most = most_timeout_ms}));
  return line;
}

OpenInstrument configure(TableReader& daq, std::vector<TableReader>& channels) {
  const SerialLine line = read_line(daq);
  const RegisterMap map = read_register_map(daq, channels);
  return [line, map](const OpenOptions& options) -> std::unique_ptr<Instrument> {
    SerialLine opened = line;
    if (options.address) opened.port = *options.address;
    opened.timeout_ms = std::max(opened.timeout_ms, options.least_timeout_ms);
    return open_modbus(map, std::make_unique<RtuLine>(opened, map.unit));
  };
}

}  // namespace

const Driver modbus_rtu_driver{"modbus-rtu", Line::serial, configure};

}  // namespace diastole::daq
