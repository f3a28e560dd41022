#pragma once
// What the simulated rig takes from the rig file that the daemon reads too (format "diastole-rig"): geometry,
// microsteps and channels; and from its optional table [simulation] what only a simulation needs:
//
//   [simulation]
//   C1_kPa = 8.8                  # stiffness of the gel phantom, W = C1 (I1 - 3)
//   cavity_noise_kPa = 0.03       # standard deviation; pump_noise_kPa = 0.09
//   cavity_offset_kPa = 0.0       # zero error of the transducer; pump_offset_kPa
//   noise_correlation_ms = 10.0
//   daq_bits = 12                 # converter steps over +-cavity_range_kPa of [rig]; 0: none
//   daq_clock_error_ppm = 0.0
//   piston_lag_ms = 2.0           # motor and screw: time constant of each of two poles; else half of drive_lag_s of [rig]
//   hose_wave_speed_m_s = 400.0   # the hose's true one, if [rig] says another
//   minor_loss_K = 1.5            # the same of hose_minor_loss_K
//   wall_creep_fraction = 0.05    # of the hose's elastic compliance; wall_creep_time_s = 0.1; if [rig] says others

#include <string>
#include <vector>

#include "protocol/contract/table_reader.hpp"
#include "tools/sim_rig/plant/plant.hpp"

namespace diastole::sim_rig {

/// A transducer on the instrument's input: volts = zero_V + pressure / kPa_per_V.
struct DaqChannel {
  enum class Place { cavity, pump, none } place = Place::cavity;
  std::string name;
  int64_t input = 0;
  double kPa_per_V = 1;
  double zero_V = 0;
};

struct RigDescription {
  PlantConfig plant;
  double microstep_mL = 0;
  std::vector<DaqChannel> channels;
  double daq_clock_error_ppm = 0;
  uint64_t daq_timeout_ns = 0;  ///< of the daemon for one answer: timeout_ms of [daq]
};

/// Throws InputError. Keys that concern only the daemon are left to the daemon to check.
RigDescription read_rig_description(TableReader root);

/// The rig file used when none is given: examples/rig.toml as it was when the program was built.
std::string default_rig_toml();

}  // namespace diastole::sim_rig
