#include "host/daq/modbus_registers.hpp"

#include <fmt/format.h>
#include <modbus/modbus.h>

#include <algorithm>
#include <array>
#include <bit>

#include "protocol/contract/input_error.hpp"

namespace diastole::daq {
namespace {

constexpr int core_timer_register = 61520;
constexpr double core_timer_rate_Hz = 40e6;
constexpr int test_register = 55100;
constexpr uint32_t test_value = 0x00112233;
constexpr int most_registers = MODBUS_MAX_READ_REGISTERS;

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

class ModbusInstrument final : public PolledInstrument {
 public:
  ModbusInstrument(RegisterMap map, std::unique_ptr<ModbusLine> line)
      : map_(std::move(map)),
        line_(std::move(line)),
        first_(map_.first_register()),
        registers_(static_cast<size_t>(map_.span())) {
    map_.labjack ? check_identity() : check_presence();
  }

  [[nodiscard]] std::string describe() const override { return line_->describe(); }
  [[nodiscard]] size_t channels() const override { return map_.inputs.size(); }
  [[nodiscard]] double timer_rate_Hz() const override { return map_.timer_rate_Hz; }
  [[nodiscard]] RatePlan plan_rate(double asked_Hz) const override {
    return line_->plan_rate(asked_Hz, map_.span());
  }

  Outcome read(std::span<double> volts) override {
    if (const std::string fault = line_->ask(map_.input_function, first_, registers_); !fault.empty()) {
      return {false, fault};
    }
    for (size_t i = 0; i < map_.inputs.size(); ++i) {
      const Input& input = map_.inputs[i];
      volts[i] = volts_of(input, &registers_[static_cast<size_t>(input.first_register - first_)]);
    }
    return {};
  }

  std::optional<uint32_t> read_timer() override {
    std::array<uint16_t, 2> pair{};
    if (!line_->ready() || !map_.timer_register) return std::nullopt;
    if (!line_->ask(map_.input_function, *map_.timer_register, pair).empty()) return std::nullopt;
    return pair_at(pair.data());
  }

 private:
  void check_presence() {
    const std::string fault = line_->ask(map_.input_function, first_, registers_);
    if (!fault.empty()) throw HardwareError(describe(), fault, line_->remedy());
  }

  void check_identity() {
    std::array<uint16_t, 2> pair{};
    const std::string fault = line_->ask(false, test_register, pair);
    if (fault.empty() && pair_at(pair.data()) == test_value) return;
    if (!fault.empty()) throw HardwareError(describe(), fault, line_->remedy());
    throw HardwareError(
        describe(),
        fmt::format("is not a LabJack T (register {} reads {:#010x})", test_register, pair_at(pair.data())),
        "Remove preset = \"labjack-t\" and describe the register map, or name the right instrument.");
  }

  RegisterMap map_;
  std::unique_ptr<ModbusLine> line_;
  int first_;
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

}  // namespace

int RegisterMap::first_register() const {
  const auto by_first = [](const Input& a, const Input& b) { return a.first_register < b.first_register; };
  return std::min_element(inputs.begin(), inputs.end(), by_first)->first_register;
}

int RegisterMap::span() const {
  int end = 0;
  for (const Input& input : inputs)
    end = std::max(end, input.first_register + input.width());
  return end - first_register();
}

RegisterMap read_register_map(TableReader& daq, std::vector<TableReader>& channels) {
  RegisterMap map;
  map.unit = static_cast<int>(daq.integer_or("unit", map.unit, {.at_least = 0, .at_most = 255}));
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
  if (map.span() > most_registers) {
    daq.fail("channel",
             fmt::format("spans {} registers; one Modbus request carries {}", map.span(), most_registers),
             "Connect the transducers to inputs that lie closer together.");
  }
  return map;
}

RatePlan ModbusLine::plan_rate(double asked_Hz, int /*registers*/) const { return {asked_Hz, {}}; }

std::unique_ptr<PolledInstrument> open_modbus(RegisterMap map, std::unique_ptr<ModbusLine> line) {
  return std::make_unique<ModbusInstrument>(std::move(map), std::move(line));
}

}  // namespace diastole::daq
