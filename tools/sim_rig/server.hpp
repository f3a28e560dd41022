#pragma once
// The simulated rig at work: one thread that waits for the serial line, the instrument's clients and the
// conductor, and moves the rig's time, either as the daemon conducts it or with the wall clock.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "tools/sim_daq/modbus_instrument.hpp"
#include "tools/sim_rig/conductor_server.hpp"
#include "tools/sim_rig/pin_trace.hpp"
#include "tools/sim_rig/pty_line.hpp"
#include "tools/sim_rig/rig.hpp"
#include "tools/sim_rig/rig_faults.hpp"

namespace diastole::sim_rig {

struct ServerOptions {
  std::filesystem::path link;       ///< symbolic link to the pseudo-terminal; empty: none
  std::filesystem::path conductor;  ///< socket; empty: time follows the wall clock
  std::filesystem::path pins;       ///< pin trace; empty: none
  uint16_t modbus_port = 0;         ///< 0: any free one
  RigFaults faults{};
};

class Server {
 public:
  /// Opens everything. Throws InputError or HardwareError.
  Server(const RigDescription& description, std::unique_ptr<SimulatedController> controller,
         const ServerOptions& options);

  /// One JSON document on one line: pty, modbus_host, modbus_port, conductor.
  [[nodiscard]] std::string addresses() const;

  /// Serves until `stop_descriptor` becomes readable, then closes the pin trace.
  void run(int stop_descriptor);

 private:
  void advance_to(uint64_t until_ns);
  void take_trigger(uint64_t time_ns);
  void take_serial();
  void conduct(const conductor::Advance& question);

  ServerOptions options_;
  PtyLine line_;
  std::optional<PinTrace> pins_;
  bool triggered_ = false;
  Rig rig_;
  sim_daq::ModbusInstrument instrument_;
  std::optional<ConductorServer> conductor_;
};

}  // namespace diastole::sim_rig
