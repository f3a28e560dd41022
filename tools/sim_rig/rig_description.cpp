#include "tools/sim_rig/rig_description.hpp"

#include <numbers>

#include "tools/sim_rig/default_rig.hpp"

namespace diastole::sim_rig {
namespace {

constexpr NumberRange positive{.above = 0};
constexpr NumberRange not_negative{.at_least = 0};

void read_geometry(TableReader& rig, int64_t microsteps, RigDescription& description) {
  HoseConfig& hose = description.plant.hose;
  hose.length_m = rig.number("hose_length_m", positive);
  hose.bore_mm = rig.number("hose_bore_mm", positive);
  hose.wave_speed_m_s = rig.number_or("hose_wave_speed_m_s", hose.wave_speed_m_s, positive);
  hose.wall_creep_fraction =
      rig.number_or("hose_creep_fraction", hose.wall_creep_fraction, {.at_least = 0, .at_most = 0.5});
  hose.wall_creep_time_s = rig.number_or("hose_creep_time_s", hose.wall_creep_time_s, {.at_least = 0.01});
  hose.fluid_density_kg_m3 = rig.number("fluid_density_kg_m3", positive);
  hose.fluid_viscosity_Pa_s = rig.number_or("fluid_viscosity_Pa_s", hose.fluid_viscosity_Pa_s, positive);
  PlantConfig& plant = description.plant;
  constexpr double ms_per_s = 1000;
  constexpr int poles = 2;
  plant.piston_lag_ms =
      ms_per_s / poles *
      rig.number_or("drive_lag_s", poles / ms_per_s * plant.piston_lag_ms, {.above = 0, .at_most = 1});
  plant.minor_loss_K = rig.number_or("hose_minor_loss_K", plant.minor_loss_K, not_negative);
  plant.cavity.f0_Hz = rig.number_or("catheter_f0_Hz", plant.cavity.f0_Hz, positive);
  plant.cavity.zeta = rig.number_or("catheter_zeta", plant.cavity.zeta, positive);
  plant.cavity.range_kPa = rig.number_or("cavity_range_kPa", plant.cavity.range_kPa, positive);
  plant.pump.range_kPa = rig.number_or("pump_range_kPa", plant.pump.range_kPa, positive);

  const double bore_mm = rig.number("bore_mm", positive);
  const double microsteps_per_mm = rig.number("screw_rev_per_cm", positive) / 10 *
                                   rig.number("steps_per_rev", positive) * static_cast<double>(microsteps);
  constexpr double mm3_per_mL = 1000;
  description.microstep_mL = std::numbers::pi / 4 * bore_mm * bore_mm / microsteps_per_mm / mm3_per_mL;
}

void read_channels(TableReader& daq, RigDescription& description) {
  int64_t next_input = 0;
  for (TableReader& table : daq.tables("channel")) {
    DaqChannel channel;
    channel.name = table.text("name");
    channel.input = table.integer_or("input", next_input, {.at_least = 0, .at_most = 13});
    channel.kPa_per_V = table.number("kPa_per_V");
    if (channel.kPa_per_V == 0)
      table.fail("kPa_per_V", "is 0", "Give the transducer's; below 0 if inverted.");
    channel.zero_V = table.number_or("zero_V", 0);
    next_input = channel.input + 1;
    channel.place = channel.name == "cavity" ? DaqChannel::Place::cavity
                    : channel.name == "pump" ? DaqChannel::Place::pump
                                             : DaqChannel::Place::none;
    description.channels.push_back(channel);
  }
}

void read_simulation(TableReader& table, RigDescription& description) {
  PlantConfig& plant = description.plant;
  plant.C1_kPa = table.number_or("C1_kPa", plant.C1_kPa, positive);
  plant.piston_lag_ms = table.number_or("piston_lag_ms", plant.piston_lag_ms, positive);
  plant.cavity.noise_kPa = table.number_or("cavity_noise_kPa", plant.cavity.noise_kPa, not_negative);
  plant.pump.noise_kPa = table.number_or("pump_noise_kPa", plant.pump.noise_kPa, not_negative);
  plant.cavity.offset_kPa = table.number_or("cavity_offset_kPa", 0);
  plant.pump.offset_kPa = table.number_or("pump_offset_kPa", 0);
  const double correlation_ms =
      table.number_or("noise_correlation_ms", plant.cavity.noise_correlation_ms, positive);
  const auto bits =
      static_cast<int>(table.integer_or("daq_bits", plant.cavity.bits, {.at_least = 0, .at_most = 24}));
  for (SensorConfig* sensor : {&plant.cavity, &plant.pump}) {
    sensor->noise_correlation_ms = correlation_ms;
    sensor->bits = bits;
  }
  description.daq_clock_error_ppm =
      table.number_or("daq_clock_error_ppm", 0, {.at_least = -1000, .at_most = 1000});
  HoseConfig& hose = plant.hose;
  hose.wall_creep_fraction =
      table.number_or("wall_creep_fraction", hose.wall_creep_fraction, {.at_least = 0, .at_most = 0.5});
  hose.wall_creep_time_s = table.number_or("wall_creep_time_s", hose.wall_creep_time_s, {.at_least = 0.01});
  hose.wave_speed_m_s = table.number_or("hose_wave_speed_m_s", hose.wave_speed_m_s, positive);
  plant.minor_loss_K = table.number_or("minor_loss_K", plant.minor_loss_K, not_negative);
  table.finish();
}

}  // namespace

RigDescription read_rig_description(TableReader root) {
  root.expect_format("diastole-rig", 1);
  RigDescription description;
  description.plant.cavity.noise_kPa = 0.03;
  description.plant.pump.noise_kPa = 0.09;
  TableReader rig = root.table("rig");
  const int64_t microsteps =
      root.table("controller").integer_or("microsteps", 8, {.at_least = 1, .at_most = 256});
  read_geometry(rig, microsteps, description);
  TableReader daq = root.table("daq");
  read_channels(daq, description);
  constexpr int64_t usual_timeout_ms = 20, ns_per_ms = 1'000'000;
  description.daq_timeout_ns = static_cast<uint64_t>(
      ns_per_ms * daq.integer_or("timeout_ms", usual_timeout_ms, {.at_least = 1, .at_most = 1000}));
  if (auto simulation = root.table_if("simulation")) read_simulation(*simulation, description);
  description.plant.hose.segments = segments_for(description.plant.hose);
  return description;
}

std::string default_rig_toml() { return default_rig_text; }

}  // namespace diastole::sim_rig
