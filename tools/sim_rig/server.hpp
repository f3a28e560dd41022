#pragma once
// The simulated rig at work: one thread that waits for the serial line, the instrument's clients, the conductor and
// the control socket, and moves the rig's time, either as the daemon conducts it or with the wall clock.
//
// Orders at the control socket, one a line:
//
//   fault on NAME [VALUE]     from now on          fault off NAME
//   hold WHEN                 answered "ok" at once, and "held WHEN" when conducted time has come there; WHEN as
//                             fault_schedule.hpp says, of the run that is on or of the next; time then stands still
//                             until
//   go                        or until that client is gone. With the wall clock "held" is sent, but time goes on.
//   state                     JSON: now_s, run_s (since the start of run, or null), faults (those that are on)

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "tools/sim_controller/pin_trace.hpp"
#include "tools/sim_daq/modbus_instrument.hpp"
#include "tools/sim_rig/conductor_server.hpp"
#include "tools/sim_rig/control_server.hpp"
#include "tools/sim_rig/playback.hpp"
#include "tools/sim_rig/rig.hpp"
#include "tools/sim_rig/run_clock.hpp"
#include "tools/sim_rig/timeline.hpp"
#include "tools/sim_rig/volume_trace.hpp"

namespace diastole::sim_rig {

struct ServerOptions {
  std::filesystem::path link;       ///< symbolic link to the pseudo-terminal; empty: none
  std::filesystem::path conductor;  ///< socket; empty: time follows the wall clock
  std::filesystem::path control;    ///< socket; empty: none
  std::filesystem::path pins;       ///< pin trace; empty: none
  std::filesystem::path volume;     ///< trace of the cavity's true volume; empty: none
  std::filesystem::path play;       ///< recorded run whose pressure the instrument shows; empty: the plant's
  uint16_t modbus_port = 0;         ///< 0: any free one
  double host_drift_ppm = 0;        ///< by which a conducted host's clock runs fast
  std::vector<FaultSwitch> faults{};
};

class Server {
 public:
  /// Opens everything. Throws InputError or HardwareError.
  Server(const RigDescription& description, std::unique_ptr<sim_controller::SimulatedController> controller,
         const ServerOptions& options);

  /// One JSON document on one line: pty, modbus_host, modbus_port, conductor, control.
  [[nodiscard]] std::string addresses() const;

  /// Serves until `stop_descriptor` becomes readable, then closes the pin trace.
  void run(int stop_descriptor);

 private:
  struct HeldAnswer {
    conductor::Advanced answer;
    ControlServer::ClientId by;
  };

  void catch_up(uint64_t until_ns);
  void advance_to(uint64_t until_ns);
  void set(const FaultKind& kind, std::optional<double> value);
  void take_sent(std::span<const uint8_t> bytes);
  void take_edge(const sim_controller::PinEdge& edge);
  void take_serial();
  [[nodiscard]] bool conducted() const { return conductor_ && conductor_->connected(); }
  void conduct(const conductor::Advance& question);
  [[nodiscard]] uint64_t host_ns() const;
  sim_daq::Wait let_wait(uint64_t late_ns);
  void hold_or_answer(const conductor::Advanced& answer);
  std::string obey(ControlServer::ClientId client, const std::string& order);
  std::string obey_fault(const std::string& order);
  [[nodiscard]] std::string state() const;

  ServerOptions options_;
  uint64_t daq_timeout_ns_;
  Cables cables_;
  std::optional<sim_controller::PinTrace> pins_;
  std::optional<VolumeTrace> volume_;
  RunClock run_clock_;
  Timeline timeline_;
  std::map<std::string_view, double> faults_on_;
  std::optional<Playback> playback_;
  Rig rig_;
  sim_daq::ModbusInstrument instrument_;
  std::optional<ConductorServer> conductor_;
  std::optional<ControlServer> control_;
  std::optional<HeldAnswer> held_;
};

}  // namespace diastole::sim_rig
