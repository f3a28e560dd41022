// The units that names state.

#include "protocol/runfile/layout.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace diastole::runfile {
namespace {

TEST(Layout, TheAttributesOfARigStateTheirUnitOrNone) {
  constexpr std::pair<const char*, const char*> expected[] = {
      {"bore_mm", "mm"},
      {"screw_rev_per_cm", "rev/cm"},
      {"steps_per_rev", "1/rev"},
      {"microsteps", "1"},
      {"volume_per_step_mL", "mL"},
      {"hose_length_m", "m"},
      {"hose_bore_mm", "mm"},
      {"hose_wave_speed_m_s", "m/s"},
      {"hose_creep_fraction", "1"},
      {"hose_creep_time_s", "s"},
      {"hose_minor_loss_K", "1"},
      {"hose_loss_at_cavity", "1"},
      {"fluid_density_kg_m3", "kg/m3"},
      {"fluid_viscosity_Pa_s", "Pa s"},
      {"catheter_length_m", "m"},
      {"catheter_f0_Hz", "Hz"},
      {"catheter_zeta", "1"},
      {"atmospheric_kPa", "kPa"},
      {"specimen_temperature_degC", "degC"},
      {"room_temperature_C", "degC"},
      {"cavity_range_kPa", "kPa"},
      {"cavity_resolution_kPa", "kPa"},
      {"cavity_kPa_per_V", "kPa/V"},
      {"cavity_zero_V", "V"},
      {"drive_lag_s", "s"},
      {"daq_rate_Hz", "Hz"},
      {"daq_bits", "1"},
      {"limit_travel_mL", "mL"},
      {"limit_flow_mL_s", "mL/s"},
      {"limit_acceleration_mL_s2", "mL/s2"},
      {"limit_step_rate_Hz", "Hz"},
      {"limit_pressure_kPa", "kPa"},
      {"lease_ms", "ms"},
      {"calibration_ppm", "ppm"},
      {"backlash_um", "um"},
      {"travel_mm", "mm"},
      {"full_step_rate_Hz", "Hz"},
      {"settings_record", "1"},
      {"tolerance_hose_creep", "1"},
  };
  for (const auto& [name, unit] : expected)
    EXPECT_EQ(unit_of(name), unit) << name;
}

/// A table's units are "name: unit; ..."; only texts have another than their name states.
template <typename Columns>
void expect_stated_units(const Table<Columns>& table) {
  const std::string units = fmt::format("; {};", table.units);
  const auto expect = [&](const char* name) {
    const bool is_text = units.find(fmt::format("; {}: text;", name)) != units.npos;
    EXPECT_NE(units.find(fmt::format("; {}: {};", name, is_text ? text_unit : unit_of(name))), units.npos)
        << table.path << " " << name;
  };
  std::apply([&](const auto&... column) { (expect(column.name), ...); }, table.columns);
}

TEST(Layout, ColumnsAndDatasetsStateTheirUnits) {
  expect_stated_units(segments_table);
  expect_stated_units(slices_table);
  expect_stated_units(gaps_table);
  expect_stated_units(events_table);
  for (const char* name : {pump_time, pressure_time, trigger_time, trigger_delay, grid_start, grid_end})
    EXPECT_EQ(unit_of(name), time_unit) << name;
  EXPECT_EQ(unit_of(pump_commanded), volume_unit);
  EXPECT_EQ(unit_of(cavity_channel), pressure_unit);
  EXPECT_EQ(unit_of(cavity_filtered_channel), pressure_unit);
  EXPECT_EQ(unit_of(grid_rate), "Hz");
  for (const char* name : {"host_offset_s", "daq_offset_s", "host_residual_s"})
    EXPECT_EQ(unit_of(name), "s") << name;
  EXPECT_EQ(unit_of("daq_drift_ppm"), "ppm");
}

}  // namespace
}  // namespace diastole::runfile
