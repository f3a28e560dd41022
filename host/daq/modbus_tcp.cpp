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
// closes the connection, and the next reading opens a new one. A reading takes no longer than timeout_ms, with
// its reconnecting; the host's name is looked up once, at the start.

#include <fmt/format.h>
#include <modbus/modbus.h>
#include <netdb.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <chrono>

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

/// The numeric addresses of a host. Throws HardwareError if it has none.
std::vector<std::string> addresses_of(const std::string& host) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  std::vector<std::string> addresses;
  if (getaddrinfo(host.c_str(), nullptr, &hints, &found) == 0) {
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, &freeaddrinfo);
    for (const addrinfo* each = list.get(); each != nullptr; each = each->ai_next) {
      std::array<char, NI_MAXHOST> numeric{};
      if (getnameinfo(each->ai_addr, each->ai_addrlen, numeric.data(), numeric.size(), nullptr, 0,
                      NI_NUMERICHOST) == 0) {
        addresses.emplace_back(numeric.data());
      }
    }
  }
  if (!addresses.empty()) return addresses;
  throw HardwareError("modbus-tcp at " + host, "is no host that can be found",
                      "Check host in [daq], or give the address in numbers.");
}

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
    find();
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
    if (context_ == nullptr) return std::nullopt;  // the next reading connects
    if (!map_.timer_register || !ask(*map_.timer_register, pair).empty()) return std::nullopt;
    return pair_at(pair.data());
  }

 private:
  using Moment = std::chrono::steady_clock::time_point;

  [[nodiscard]] Moment end_of_patience() const {
    return std::chrono::steady_clock::now() + std::chrono::milliseconds(map_.timeout_ms);
  }

  /// Connects to the first of the host's addresses that answers, and keeps to it.
  void find() {
    std::string fault;
    for (const std::string& address : addresses_of(map_.host)) {
      address_ = address;
      fault = connect(end_of_patience());
      if (fault.empty()) return;
    }
    throw HardwareError(describe(), fault,
                        "Check that the instrument is powered and connected, and host and port in [daq].");
  }

  /// The patience for whatever is asked next: until `give_up`, and a millisecond at least.
  void be_patient_until(Moment give_up) {
    const auto left =
        std::chrono::duration_cast<std::chrono::microseconds>(give_up - std::chrono::steady_clock::now());
    const auto left_us = static_cast<uint32_t>(std::max<int64_t>(left.count(), 1000));
    modbus_set_response_timeout(context_.get(), left_us / 1'000'000, left_us % 1'000'000);
  }

  /// Empty, or why there is no connection.
  std::string connect(Moment give_up) {
    context_.reset(modbus_new_tcp_pi(address_.c_str(), std::to_string(map_.port).c_str()));
    if (context_ == nullptr) return "is not an address";
    modbus_set_byte_timeout(context_.get(), 0, 0);  // the response's time-out is for all of its bytes
    modbus_set_slave(context_.get(), map_.unit);
    be_patient_until(give_up);
    if (modbus_connect(context_.get()) == 0) return {};
    const std::string reason = modbus_strerror(errno);
    context_.reset();
    return "does not connect: " + reason;
  }

  /// Empty, or why the registers were not read; then the connection is closed.
  std::string ask(int first, std::span<uint16_t> out) {
    const Moment give_up = end_of_patience();
    if (context_ == nullptr) {
      if (std::string fault = connect(give_up); !fault.empty()) return fault;
    }
    be_patient_until(give_up);
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
  std::string address_;
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
  map.timeout_ms = static_cast<int>(
      daq.integer_or("timeout_ms", map.timeout_ms, {.at_least = 1, .at_most = most_timeout_ms}));
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
