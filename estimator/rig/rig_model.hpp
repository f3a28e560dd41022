#pragma once
// The rig as a model: commanded steps -> piston -> hose -> specimen -> catheter and sensors -> samples.
//
//   drive      what the screw turns for the commanded steps, and the volume that the piston then displaces
//   pump       what the fluid meets before the hose: a leak past the seal, gas
//   hose       distributed line (hose_line.hpp)
//   specimen   pressure by volume, with memory if an effect gives it one; leaks and gas at the cavity
//   sensors    catheter of second order and gains, offsets, clocks
//
// RigModel is the base rig: what a run's /rig describes and nothing else. An effect (estimator/effects) changes it
// through the members below, each of which has a neutral state that is the base model exactly.
//
// Units as the names say; volumes mL, pressures kPa above atmosphere, times s on the controller's clock.

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "estimator/rig/hose.hpp"
#include "estimator/rig/specimen_curve.hpp"

namespace diastole::rig {

/// A run's samples of the moving piston, evenly spaced; effects of the drive rewrite them.
struct DriveTrace {
  double start_s = 0.0;
  double step_s = 0.0;
  std::vector<double> volume_mL;
  std::vector<double> flow_mL_per_s;
  std::vector<double> acceleration_mL_per_s2;

  [[nodiscard]] double time_s(size_t k) const { return start_s + step_s * static_cast<double>(k); }
  /// Flow and acceleration by differences of the volume, for effects that only know the volume.
  void differentiate();
};

/// Which run of a session, for what depends on it.
struct RunPlace {
  std::string name;                ///< "baseline"
  double started_s = 0.0;          ///< since the session's first run began
  double cycles_before = 0.0;      ///< in the session's earlier runs
  double largest_before_mL = 0.0;  ///< commanded in them
  std::vector<double> trigger_s;   ///< the cycles' starts
  double atmosphere_kPa = 101.325;
  double turn_mL =
      12.467;  ///< that a turn of the pump's screw displaces: 10 cm bore, 6.3 turns a centimetre (the paper's)
};

/// Cycles of a session at a time of one of its runs.
struct CyclePlace {
  double done = 0.0;        ///< begun, the running one in part; whole where it is not known when it ends
  double phase = 0.0;       ///< part of the running one, 0 where none runs
  double rate_per_s = 0.0;  ///< at which it passes
};
CyclePlace cycle_at(const RunPlace& place, double time_s);

/// A branch from which volume flows away at a node's pressure: leaks. mL/s by kPa and time; one lives for one run.
using LeakLaw = std::function<double(double pressure_kPa, double time_s)>;
using LeakMaker = std::function<LeakLaw(const RunPlace&)>;

/// Pressure lost on the way from the cylinder into the hose, kPa by the flow into it and the volume that the specimen holds;
/// one lives for one run.
using LossLaw = std::function<double(double flow_mL_per_s, double volume_mL, double time_s)>;
using LossMaker = std::function<LossLaw(const RunPlace&)>;

/// Pressure of the specimen by its elastic pressure and volume; may keep a state, so that one lives for one run.
/// `look` must not change the state; `pass` goes on to `time_s` and does.
class SpecimenMemory {
 public:
  virtual ~SpecimenMemory() = default;
  /// The pressure if the elastic one is `elastic_kPa` at `volume_mL` at this time.
  [[nodiscard]] virtual double look(double elastic_kPa, double volume_mL, double time_s) const = 0;
  virtual void pass(double elastic_kPa, double volume_mL, double time_s) = 0;
};
using MemoryMaker = std::function<std::unique_ptr<SpecimenMemory>(const RunPlace&)>;

/// Second order: p_out'' + 2 zeta w p_out' + w^2 p_out = w^2 p_in, w = 2 pi f0.
struct Catheter {
  double resonance_Hz = 60.0;
  double damping = 0.6;
};

/// A change of a measured pressure by time: kPa read if kPa are there; one lives for one run.
using SensorMap = std::function<double(double pressure_kPa, double time_s)>;
using SensorMapMaker = std::function<SensorMap(const RunPlace&)>;
/// The same of a sensor with a memory, along evenly spaced times.
using SensorTraceMap =
    std::function<void(std::vector<double>& pressure_kPa, double start_s, double step_s, const RunPlace&)>;

using DriveMap = std::function<void(DriveTrace&, const RunPlace&)>;

/// An error of the piston's volume by the screw's angle a, miscounted steps left out: sine sin(a) + cosine (1 - cos(a)).
struct TurningError {
  double sine_mL = 0.0, cosine_mL = 0.0;
};

struct RigModel {
  Hose hose;
  SpecimenCurve curve;  ///< at a modulus of 1 kPa
  double modulus_kPa = 6.0;
  Catheter catheter;
  double drive_lag_s = 0.0;  ///< the piston follows its steps this much later

  // Nuisances of the sensors, per run set by the fit.
  double cavity_offset_kPa = 0.0;
  double pump_offset_kPa = 0.0;

  // Hooks of effects, in the order in which they were added.
  std::vector<DriveMap> turns;                 ///< from commanded steps to what the screw turns, in mL
  std::array<TurningError, 2> turning_errors;  ///< of the angle and of twice the angle, before `drive`
  std::vector<DriveMap> drive;                 ///< from there to the piston
  bool has_corners = false;                    ///< the motion or a law may have some, which want short steps
  double pump_gas_mL = 0.0;                    ///< at rest; between piston and hose
  double cavity_gas_mL = 0.0;                  ///< at rest; beside the specimen
  double gas_exponent =
      1.2;  ///< of p V^n: bubbles at about a hertz are between isothermal (1) and adiabatic (1.4)
  double pump_leak_mL_s_kPa = 0.0;           ///< conductance past the seal
  double drive_compliance_mL_per_kPa = 0.0;  ///< by which screw, piston and cylinder yield
  /// What leaks past the seal beyond that conductance.
  std::vector<LeakMaker> pump_leaks;
  std::vector<LossMaker> pump_losses;
  std::vector<LeakMaker> cavity_leaks;
  std::vector<MemoryMaker> memories;
  std::vector<SensorTraceMap> cavity_traces;  ///< behind the catheter, before the maps
  std::vector<SensorMapMaker> cavity_sensor;
  double volume_gain = 1.0;     ///< of gated volumes
  double sample_delay_s = 0.0;  ///< samples show what was there this much earlier
  double sample_skew = 0.0;     ///< and the DAQ's clock runs fast by this part: counts more seconds
};

}  // namespace diastole::rig
