#pragma once
// The run file NAME.run.h5: every name in it and the unit that its `units` attribute states.
// What the file means to a user is in docs/run-file.md; reader.hpp reads it, host/runfile writes it.
//
//   /                      attributes format, format_version, run_id, started_utc, producer
//   |-- rig                attributes only: bore_mm, screw_rev_per_cm, ...
//   |-- protocol
//   |   |-- toml           scalar text: the experiment file as it was run
//   |   |-- segments       table start_s, waveform, stroke_mL, period_s, offset_mL, cycles
//   |   |-- slices         optional table block, slice, first_trigger, triggers, cycles, dummy_cycles
//   |   `-- waveforms/<segment>   of uploaded segments: points (text), phase[w], fraction[w]
//   |-- pump               time_s[n], commanded_mL[n]
//   |-- pressure           time_s[m], cavity_kPa[m], optionally cavity_filtered_kPa[m], pump_kPa[m]
//   |                      both groups optionally with attributes grid_start_s, grid_end_s, grid_rate_Hz
//   |-- trigger            time_s[k], optionally delay_s (scalar)
//   |-- mr/flow/<segment>  optional: phase_s[f], cavity_mL[f], sigma_mL[f]; segments count from 0
//   |-- clock              optional: scalars such as daq_offset_s, daq_drift_ppm
//   |-- session            optional: attributes specimen, operator, room_temperature_C
//   |   `-- notes/<number> optional: one text a note, numbered from 0001 as they were written; attributes written_utc,
//   |                      author
//   |-- gaps               table stream, first_index, count, reason; empty says that nothing is missing
//   `-- events             table time_s, level, code, text
//
// A missing sample keeps its row, so that row = sample index in every stream: its time is when it was due,
// its values are NaN, and a row of /gaps declares it. Times are seconds on the controller's clock since the
// run started.

#include <array>
#include <cstdint>
#include <string_view>
#include <tuple>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

inline constexpr std::string_view format_name = "diastole-run";
inline constexpr int64_t format_version = 1;

inline constexpr const char* rig_group = "/rig";
inline constexpr const char* protocol_group = "/protocol";
inline constexpr const char* protocol_toml = "/protocol/toml";
inline constexpr const char* waveforms_group = "/protocol/waveforms";
inline constexpr const char* pump_group = "/pump";
inline constexpr const char* pump_time = "/pump/time_s";
inline constexpr const char* pump_commanded = "/pump/commanded_mL";
inline constexpr const char* pressure_group = "/pressure";
inline constexpr const char* pressure_time = "/pressure/time_s";
inline constexpr const char* cavity_channel = "cavity_kPa";
inline constexpr const char* cavity_filtered_channel = "cavity_filtered_kPa";
/// Attributes of the groups pressure and pump: StreamGrid (run.hpp).
inline constexpr const char* grid_start = "grid_start_s";
inline constexpr const char* grid_end = "grid_end_s";
inline constexpr const char* grid_rate = "grid_rate_Hz";
inline constexpr const char* trigger_group = "/trigger";
inline constexpr const char* trigger_time = "/trigger/time_s";
inline constexpr const char* trigger_delay = "/trigger/delay_s";
inline constexpr const char* flow_group = "/mr/flow";
inline constexpr const char* clock_group = "/clock";
inline constexpr const char* session_group = "/session";
inline constexpr const char* session_notes = "/session/notes";
/// Attributes of a note.
inline constexpr const char* note_written = "written_utc";
inline constexpr const char* note_author = "author";
/// Attributes of /session.
inline constexpr const char* specimen_fact = "specimen";
inline constexpr const char* operator_fact = "operator";
inline constexpr const char* room_temperature_fact = "room_temperature_C";

/// Streams as /gaps names them.
inline constexpr std::string_view pressure_stream = "pressure";
inline constexpr std::string_view pump_stream = "pump";
inline constexpr std::string_view trigger_stream = "trigger";

inline constexpr const char* time_unit = "s";
inline constexpr const char* volume_unit = "mL";
inline constexpr const char* pressure_unit = "kPa";
inline constexpr const char* text_unit = "text";
/// A compound table: one row for each of a vector of Row.
template <typename Row, typename Value>
struct Column {
  const char* name;
  Value Row::*member;
};
template <typename Columns>
struct Table {
  const char* path;
  const char* units;
  Columns columns;  ///< std::tuple of Column
};
template <typename Columns>
Table(const char*, const char*, Columns) -> Table<Columns>;
template <typename Row, typename Value>
Column(const char*, Value Row::*) -> Column<Row, Value>;

inline constexpr Table segments_table{
    "/protocol/segments", "start_s: s; waveform: text; stroke_mL: mL; period_s: s; offset_mL: mL; cycles: 1",
    std::tuple{Column{"start_s", &Segment::start_s}, Column{"waveform", &Segment::waveform},
               Column{"stroke_mL", &Segment::stroke_mL}, Column{"period_s", &Segment::period_s},
               Column{"offset_mL", &Segment::offset_mL}, Column{"cycles", &Segment::cycles}}};
inline constexpr Table slices_table{
    "/protocol/slices", "block: text; slice: 1; first_trigger: 1; triggers: 1; cycles: 1; dummy_cycles: 1",
    std::tuple{Column{"block", &Slice::block}, Column{"slice", &Slice::number},
               Column{"first_trigger", &Slice::first_trigger}, Column{"triggers", &Slice::triggers},
               Column{"cycles", &Slice::cycles}, Column{"dummy_cycles", &Slice::dummy_cycles}}};
inline constexpr Table gaps_table{
    "/gaps", "stream: text; first_index: 1; count: 1; reason: text",
    std::tuple{Column{"stream", &Gap::stream}, Column{"first_index", &Gap::first_index},
               Column{"count", &Gap::count}, Column{"reason", &Gap::reason}}};
inline constexpr Table events_table{
    "/events", "time_s: s; level: text; code: text; text: text",
    std::tuple{Column{"time_s", &Event::time_s}, Column{"level", &Event::level}, Column{"code", &Event::code},
               Column{"text", &Event::text}}};

/// How a name ends that states a unit. Longer endings stand before those that they end with themselves.
struct UnitEnding {
  std::string_view ending;
  std::string_view unit;
};
inline constexpr std::array unit_endings{UnitEnding{"_kPa_per_V", "kPa/V"},
                                         UnitEnding{"_rev_per_cm", "rev/cm"},
                                         UnitEnding{"_per_rev", "1/rev"},
                                         UnitEnding{"_kg_m3", "kg/m3"},
                                         UnitEnding{"_mL_s2", "mL/s2"},
                                         UnitEnding{"_mL_s", "mL/s"},
                                         UnitEnding{"_Pa_s", "Pa s"},
                                         UnitEnding{"_m_s", "m/s"},
                                         UnitEnding{"_kPa", "kPa"},
                                         UnitEnding{"_mL", "mL"},
                                         UnitEnding{"_mm", "mm"},
                                         UnitEnding{"_um", "um"},
                                         UnitEnding{"_m", "m"},
                                         UnitEnding{"_ms", "ms"},
                                         UnitEnding{"_s", "s"},
                                         UnitEnding{"_Hz", "Hz"},
                                         UnitEnding{"_V", "V"},
                                         UnitEnding{"_ppm", "ppm"},
                                         UnitEnding{"_degC", "degC"},
                                         UnitEnding{"_C", "degC"}};

/// "mL" of "commanded_mL", "kg/m3" of "fluid_density_kg_m3"; "1" of a name that states none.
inline constexpr std::string_view unit_of(std::string_view name) {
  for (const auto& [ending, unit] : unit_endings)
    if (name.ends_with(ending)) return unit;
  return "1";
}

}  // namespace diastole::runfile
