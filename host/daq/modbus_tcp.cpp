// Modbus TCP analog inputs, polled: one request a sample covers all channels.
//
//   [daq]
//   driver = "modbus-tcp"
//   host = "192.168.1.207"
//   port = 502
//   unit = 1
//   timeout_ms = 20
//   preset = "labjack-t"            # or describe the map:  function = "holding" | "input",
//   [[daq.channel]]                 #   timer_register, timer_rate_Hz
//   input = 0                       # AIN0 of the preset; or  register = 100, type = "float32" | "uint16" |
//   "int16",
//                                   #   V_per_count
//
// Registers hold 16 bits, the more significant one of a pair first. Preset "labjack-t": AIN#n is a float32 at
// register 2n, CORE_TIMER counts 40 MHz at 61520, register pair 55100 reads 0x00112233.
//
// After a time-out a late answer may still arrive and would be taken for the next one. So every failure
// closes the connection, and the next reading opens a new one.

#include <fmt/format.h>
#include <modbus/modbus.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <charconv>

#include "host/daq/driver.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::daq {
namespace {

constexpr int core_timer_register = 61520;
constexpr double core_timer_rate_Hz = 40e6;
constexpr int test_register = 55100;
constexpr uint32_t test_value = 0x00112233;
constexpr int most_registers = MODBUS_MAX_READ_REGISTERS;

enum class Coding { float32, uint16, int16 };

struct Input {
  int first_register = 0;
  Coding coding = Coding::float32;
  double V_per_count = 1;

  [[nodiscard]] int width() const { return coding == Coding::float32 ? 2 : 1; }
};

struct ModbusMap {
  std::string host;
  int port = 502;
  int unit = 1;
  int timeout_ms = 20;
  bool input_function = false;  // function code 4 instead of 3
  bool labjack = false;
  std::optional<int> timer_register;
  double timer_rate_Hz = 0;
  std::vector<Input> inputs;
};

struct FreeModbus {
  void operator()(modbus_t* context) const {
    modbus_close(context);
    modbus_free(context);
  }
};

uint32_t pair_at(const uint16_t* registers) {
  return static_cast<uint32_t>(registers[0]) << 16U | registers[1];
}

double volts_of(const Input& input, const uint16_t* registers) {
  switch (input.coding) {
    case Coding::float32:
      return static_cast<double>(std::bit_cast<float>(pair_at(registers)));
    case Coding::uint16:
      return input.V_per_count * registers[0];
    case Coding::int16:
      return input.V_per_count * static_cast<int16_t>(registers[0]);
  }
  return 0;
}

class ModbusTcp final : public Instrument {
 public:
  explicit ModbusTcp(ModbusMap map) : map_(std::move(map)) {
    const auto by_first = [](const Input& a, const Input& b) { return a.first_register < b.first_register; };
    first_ = std::min_element(map_.inputs.begin(), map_.inputs.end(), by_first)->first_register;
    int end = first_;
    for (const Input& input : map_.inputs)
      end = std::max(end, input.first_register + input.width());
    registers_.resize(static_cast<size_t>(end - first_));
    if (const std::string fault = connect(); !fault.empty()) {
      throw HardwareError(describe(), fault,
                          "Check that the instrument is powered and connected, and host and port in [daq].");
    }
    if (map_.labjack) check_identity();
  }

  [[nodiscard]] std::string describe() const override {
    return fmt::format("modbus-tcp at {}:{}", map_.host, map_.port);
  }
  [[nodiscard]] size_t channels() const override { return map_.inputs.size(); }
  [[nodiscard]] double timer_rate_Hz() const override { return map_.timer_rate_Hz; }

  Outcome read(std::span<double> volts) override {
    if (const std::string fault = ask(first_, registers_); !fault.empty()) return {false, fault};
    for (size_t i = 0; i < map_.inputs.size(); ++i) {
      volts[i] =
          volts_of(map_.inputs[i], &registers_[static_cast<size_t>(map_.inputs[i].first_register - first_)]);
    }
    return {};
  }

  std::optional<uint32_t> read_timer() override {
    std::array<uint16_t, 2> pair{};
    if (!map_.timer_register || !ask(*map_.timer_register, pair).empty()) return std::nullopt;
    return pair_at(pair.data());
  }

 private:
  /// Empty, or why there is no connection.
  std::string connect() {
    context_.reset(modbus_new_tcp_pi(map_.host.c_str(), std::to_string(map_.port).c_str()));
    if (context_ == nullptr) return "is not an address";
    const auto timeout_us = static_cast<uint32_t>(map_.timeout_ms) * 1000;
    modbus_set_response_timeout(context_.get(), timeout_us / 1'000'000, timeout_us % 1'000'000);
    modbus_set_slave(context_.get(), map_.unit);
    if (modbus_connect(context_.get()) == 0) return {};
    const std::string reason = modbus_strerror(errno);
    context_.reset();
    return "does not connect: " + reason;
  }

  /// Empty, or why the registers were not read; then the connection is closed.
  std::string ask(int first, std::span<uint16_t> out) {
    if (context_ == nullptr) {
      if (std::string fault = connect(); !fault.empty()) return fault;
    }
    const auto read = map_.input_function ? modbus_read_input_registers : modbus_read_registers;
    const int count = static_cast<int>(out.size());
    if (read(context_.get(), first, count, out.data()) == count) return {};
    const std::string reason =
        errno == ETIMEDOUT ? fmt::format("no answer within {} ms", map_.timeout_ms) : modbus_strerror(errno);
    context_.reset();
    return reason;
  }

  void check_identity() {
    std::array<uint16_t, 2> pair{};
    const std::string fault = ask(test_register, pair);
    if (fault.empty() && pair_at(pair.data()) == test_value) return;
    throw HardwareError(
        describe(),
        fault.empty() ? fmt::format("is not a LabJack T (register {} reads {:#010x})", test_register,
                                    pair_at(pair.data()))
                      : fault,
        "Remove preset = \"labjack-t\" and describe the register map, or name the right host.");
  }

  ModbusMap map_;
  std::unique_ptr<modbus_t, FreeModbus> context_;
  int first_ = 0;
  std::vector<uint16_t> registers_;
};

Input read_input(TableReader& channel, bool labjack) {
  Input input;
  if (labjack) {
    input.first_register = 2 * static_cast<int>(channel.integer("input", {.at_least = 0, .at_most = 254}));
    return input;
  }
  input.first_register = static_cast<int>(channel.integer("register", {.at_least = 0, .at_most = 65534}));
  const std::string type = channel.choice("type", {"float32", "uint16", "int16"});
  input.coding = type == "float32" ? Coding::float32 : type == "uint16" ? Coding::uint16 : Coding::int16;
  input.V_per_count = channel.number_or("V_per_count", 1);
  return input;
}

void check_span(const TableReader& daq, const std::vector<Input>& inputs) {
  const auto [least, most] =
      std::minmax_element(inputs.begin(), inputs.end(),
                          [](const Input& a, const Input& b) { return a.first_register < b.first_register; });
  const int registers = most->first_register + most->width() - least->first_register;
  if (registers > most_registers) {
    daq.fail("channel",
             fmt::format("spans {} registers; one Modbus request carries {}", registers, most_registers),
             "Connect the transducers to inputs that lie closer together.");
  }
}

/// Splits "host:port".
void take_address(ModbusMap& map, const std::string& address) {
  const size_t colon = address.rfind(':');
  const char* end = address.data() + address.size();
  if (colon == std::string::npos || std::from_chars(address.data() + colon + 1, end, map.port).ptr != end) {
    throw InputError({"", "--daq " + address, "is not HOST:PORT", "For example --daq 127.0.0.1:1502."});
  }
  map.host = address.substr(0, colon);
}

}  // namespace

OpenInstrument configure_modbus_tcp(TableReader& daq, std::vector<TableReader>& channels) {
  ModbusMap map;
  map.host = daq.text("host");
  map.port = static_cast<int>(daq.integer_or("port", map.port, {.at_least = 1, .at_most = 65535}));
  map.unit = static_cast<int>(daq.integer_or("unit", map.unit, {.at_least = 0, .at_most = 255}));
  map.timeout_ms =
      static_cast<int>(daq.integer_or("timeout_ms", map.timeout_ms, {.at_least = 1, .at_most = 10'000}));
  map.labjack = daq.has("preset") && daq.choice("preset", {"labjack-t"}) == "labjack-t";
  if (map.labjack) {
    map.timer_register = core_timer_register;
    map.timer_rate_Hz = core_timer_rate_Hz;
  } else {
    map.input_function = daq.has("function") && daq.choice("function", {"holding", "input"}) == "input";
    if (daq.has("timer_register")) {
      map.timer_register = static_cast<int>(daq.integer("timer_register", {.at_least = 0, .at_most = 65534}));
      map.timer_rate_Hz = daq.number("timer_rate_Hz", {.above = 0});
    }
  }
  for (TableReader& channel : channels)
    map.inputs.push_back(read_input(channel, map.labjack));
  check_span(daq, map.inputs);
  return [map](const OpenOptions& options) -> std::unique_ptr<Instrument> {
    ModbusMap opened = map;
    if (options.address) take_address(opened, *options.address);
    opened.timeout_ms = std::max(opened.timeout_ms, options.least_timeout_ms);
    return std::make_unique<ModbusTcp>(std::move(opened));
  };
}

}  // namespace diastole::daq
