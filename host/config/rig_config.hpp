#pragma once
// The rig file (format "diastole-rig", version 1; example in examples/rig.toml): geometry, controller,
// instrument, daemon.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/daq/driver.hpp"
#include "host/gpio/gate_inputs.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole {

using Attributes = std::map<std::string, runfile::Attribute, std::less<>>;

/// What the controller must never exceed; it checks a program against them before anything moves.
struct MotionLimits {
  double travel_mL = 7000;           ///< largest volume from home
  double flow_mL_s = 1860;           ///< the motor's 30 kHz in full steps
  double acceleration_mL_s2 = 1700;  ///< also the deceleration of a controlled stop
  double step_rate_Hz = 240'000;     ///< in microsteps
  double pressure_kPa = 79.3;        ///< at the piston: inertia, friction and losses in the hose, cavity
  double cavity_kPa = 6;             ///< what the specimen holds against the piston at most
  double homing_flow_mL_s = 5;
};

struct ControllerConfig {
  std::string port;
  unsigned baud = 460800;
  int64_t microsteps = 8;
  int64_t lease_ms = 500;  ///< the controller is at rest this long after the host fell silent
  double ttl_width_ms = 10;
  MotionLimits limits;
};

/// Pressure = (volts - zero_V) x kPa_per_V, recorded as /pressure/<name>_kPa.
struct ChannelConfig {
  std::string name;
  double kPa_per_V = 0;  ///< never 0 in a rig file; below 0: an inverted transducer
  double zero_V = 0;
};

struct DaqConfig {
  std::string driver;
  daq::OpenInstrument open;
  std::vector<ChannelConfig> channels;
};

struct DaemonConfig {
  std::string socket;
  std::filesystem::path journal_dir;
  int64_t keep_days = 30;              ///< a journal, after its run file was written; 0: for ever
  std::optional<std::string> console;  ///< [ADDRESS:]PORT of the web console; none: there is none
  std::string control_group;  ///< whose members may control the rig beside root and the daemon's user
};

/// What a steady flow of 1 L/s through the hose costs; friction is the larger of the first two (message Configure).
struct HoseLosses {
  double laminar_Pa = 0;    ///< Hagen-Poiseuille, in proportion to the flow
  double turbulent_Pa = 0;  ///< Blasius, with its power 1.75
  double minor_Pa = 0;      ///< hose_minor_loss_K at ends and bends, with its square
};

struct RigConfig {
  std::string file;       ///< for messages
  Attributes attributes;  ///< of /rig, volume_per_step_mL included
  ControllerConfig controller;
  DaqConfig daq;
  std::optional<GpioConfig> gpio;
  DaemonConfig daemon;
  double microstep_mL = 0;          ///< bore area / (screw x steps x microsteps)
  double hose_inertance_kg_m4 = 0;  ///< density x length / bore area
  HoseLosses hose_losses;
};

/// Throws InputError with file, line and key; also when a microstep or the hose's inertance, as they follow
/// from the geometry, are beyond what the controller can count with.
RigConfig read_rig(const std::filesystem::path& path);
RigConfig read_rig(TableReader root);

/// Of a daemon that is no service, in a directory of the user's own: $XDG_RUNTIME_DIR/diastole.sock, root's
/// /run/diastole.sock, /run/user/UID/diastole.sock, or $XDG_STATE_HOME/diastole/daemon.sock (~/.local/state).
std::string default_socket();
/// Makes the directory of the last of them, for nobody else.
void make_default_socket_folder();
/// Where the daemon serves that runs as a service of the system (packaging/).
inline constexpr const char* service_socket = "/run/diastole/daemon.sock";

}  // namespace diastole
