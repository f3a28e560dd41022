#pragma once
// Modbus analog inputs, polled: one request a sample covers all channels. What TCP and RTU share: the register
// map as the rig file describes it, the reading of it, and the numbers in it.
//
//   [daq]
//   preset = "labjack-t"            # or describe the map:  function = "holding" | "input",
//   unit = 1                        #   timer_register, timer_rate_Hz
//   [[daq.channel]]
//   input = 0                       # AIN0 of the preset; or  register = 100, V_per_count,
//                                   #   type = "float32" | "uint16" | "int16"
//
// Registers hold 16 bits, the more significant one of a pair first. Preset "labjack-t": AIN#n is a float32 at
// register 2n, CORE_TIMER counts 40 MHz at 61520 and wraps at 32 bits, register pair 55100 reads 0x00112233.

#include <modbus/modbus.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/daq/instrument.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::daq {

enum class Coding { float32, uint16, int16 };

struct Input {
  int first_register = 0;
  Coding coding = Coding::float32;
  double V_per_count = 1;

  [[nodiscard]] int width() const { return coding == Coding::float32 ? 2 : 1; }
};

struct RegisterMap {
  int unit = 1;
  bool input_function = false;  ///< function code 4 instead of 3
  bool labjack = false;
  std::optional<int> timer_register;
  double timer_rate_Hz = 0;
  std::vector<Input> inputs;  ///< one a channel

  [[nodiscard]] int first_register() const;
  /// From the first register of any input to the last.
  [[nodiscard]] int span() const;
};

/// Reads what this page describes; the keys of the line (host, port, baud, ...) are the driver's own. Throws
/// InputError, also when one request cannot carry all channels.
RegisterMap read_register_map(TableReader& daq, std::vector<TableReader>& channels);

/// Closed and freed with its owner.
struct FreeModbus {
  void operator()(modbus_t* context) const {
    modbus_close(context);
    modbus_free(context);
  }
};
using ModbusContext = std::unique_ptr<modbus_t, FreeModbus>;

/// One request and its answer, over whatever line.
class ModbusLine {
 public:
  virtual ~ModbusLine() = default;
  [[nodiscard]] virtual std::string describe() const = 0;
  /// What can be done when the instrument behind this line does not answer at the start.
  [[nodiscard]] virtual std::string remedy() const = 0;
  /// Empty, or why the registers were not read. A late answer is never taken for that to a later question.
  virtual std::string ask(bool input_function, int first, std::span<uint16_t> out) = 0;
  /// Whether a question can be asked without opening the line anew.
  [[nodiscard]] virtual bool ready() const = 0;
  /// As Instrument::plan_rate, when one reading asks for `registers`.
  [[nodiscard]] virtual RatePlan plan_rate(double asked_Hz, int registers) const;
};

/// Throws HardwareError when nothing answers, or with preset "labjack-t" something else does.
std::unique_ptr<PolledInstrument> open_modbus(RegisterMap map, std::unique_ptr<ModbusLine> line);

}  // namespace diastole::daq
