#pragma once
// The faults that the simulated rig can have, by name: how each is switched on and off, and what it
// looks like from outside.

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tools/sim_controller/pty_line.hpp"
#include "tools/sim_daq/modbus_instrument.hpp"
#include "tools/sim_rig/rig.hpp"

namespace diastole::sim_rig {

/// The cables that lead away from the controller, and what may be wrong with them.
struct Cables {
  explicit Cables(const std::filesystem::path& link) : line(link) {}

  sim_controller::PtyLine line;  ///< to the host
  bool to_host = true;           ///< whether what the controller sends gets through
  bool from_host = true;         ///< and what the host sends
  bool to_scanner = true;        ///< TTL and R-wave
};

/// What a fault can reach.
struct FaultTarget {
  Rig& rig;
  sim_daq::ModbusInstrument& instrument;
  Cables& cables;
};

struct FaultKind {
  std::string_view name;
  std::string_view unit = {};  ///< of its value; empty: it takes none
  double least = 0;
  double most = 0;
  double usual = 0;  ///< without a value
  std::string_view looks_like;
  /// Switches it on with a value, or off, at the rig's present. Switching on anew changes the value.
  void (*set)(FaultTarget&, std::optional<double> value) = nullptr;

  /// `given`, or the usual value. Throws InputError when it takes none or the value is outside its range.
  [[nodiscard]] double value(std::optional<double> given) const;
};

std::span<const FaultKind> fault_kinds();
/// Throws InputError that names the nearest known fault.
const FaultKind& fault_named(std::string_view name);
/// One line each: name, usual value with unit, what it looks like.
std::string list_of_faults();

}  // namespace diastole::sim_rig
