#pragma once
// What the rig answers to whoever asks it or gives it an order.

#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "host/acquisition/acquisition.hpp"
#include "host/config/rig_config.hpp"
#include "host/controller/self_test.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole {

/// The rig is occupied by another order.
class RigBusy : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The daemon's journals.
struct KeptJournals {
  std::string directory;
  size_t count = 0;
  uint64_t bytes = 0;
  int64_t without_run_file = 0;
  int64_t keep_days = 0;
};

struct JogResult {
  double jogged_mL = 0;
  bool stopped = false;  ///< on request
};

struct RigStatus {
  std::string state;  ///< the controller's; while the rig is occupied, the activity
  wire::Status controller;
  wire::Hello firmware;
  double position_mL = 0;
  std::string port;
  std::string instrument;
  std::optional<std::string> settings_problem;
  std::optional<std::string> notice;  ///< the pump was found moving and was stopped; until the next order
  KeptJournals journals;
  std::string run_id = {};            ///< of the run that is on; empty: none
  std::optional<JogResult> jog = {};  ///< what the jog that was ordered came to
};

struct SettingsReport {
  uint32_t record = 0;  ///< 0: never written
  Attributes settings;
  double microstep_uL = 0;
  int64_t backlash_microsteps = 0;
  std::optional<std::string> problem;  ///< where the rig file disagrees
};

struct BlackBox {
  std::vector<wire::BlackBoxEntry> entries;  ///< oldest first
  double tick_rate_Hz = 1;
};

struct ChannelReading {
  std::string name;
  size_t samples = 0;
  double mean_V = 0;
  double noise_kPa = 0;
  double drift_kPa = 0;
  size_t points = 0;  ///< of the calibration, this one included
  double kPa_per_V = 0;
  double zero_V = 0;
};

struct CalibrationReport {
  std::string file;  ///< empty: kept until the daemon ends
  std::vector<ChannelReading> channels;
};

struct SelfTestResult {
  std::vector<SelfTestCheck> checks;
};

/// Where a run that begins is written, and what is made of it at the end.
struct RunBegun {
  std::string run_id;
  std::string journal;
  std::string run_file;
};

using RigAnswer =
    std::variant<RigStatus, SettingsReport, BlackBox, CalibrationReport, RunBegun, SelfTestResult>;
/// Called once on the rig's thread: with an error, or with an answer.
using RigDone = std::function<void(const std::exception_ptr& error, const RigAnswer& answer)>;

struct RunResult {
  std::string end;  ///< as RunOutcome, or "failed"
  std::string journal;
  std::string problem = {};   ///< why there is no run file
  std::string run_file = {};  ///< empty: there is none
  bool regular = false;
  uint32_t cycles = 0;
  size_t triggers = 0;
  uint64_t samples = 0;
  uint64_t gaps = 0;
  int64_t errors = 0;    ///< events of that level
  int64_t expected = 0;  ///< samples
};

/// The slice for which the operator is ready.
struct ContinuedSlice {
  size_t slice = 0;
  std::string prompt;
};

}  // namespace diastole
