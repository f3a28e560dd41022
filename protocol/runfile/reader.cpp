#include "protocol/runfile/reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "protocol/runfile/h5_source.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole::runfile {
namespace {

std::string root_text(const H5Source& source, const std::map<std::string, Attribute, std::less<>>& root,
                      const std::string& name) {
  const auto found = root.find(name);
  if (found == root.end() || !std::holds_alternative<std::string>(found->second)) {
    source.fail("root attribute " + name, "is missing or not a text",
                "Every run file carries it; see docs/run-file.md.");
  }
  return std::get<std::string>(found->second);
}

void expect_format(const H5Source& source, const std::map<std::string, Attribute, std::less<>>& root) {
  if (const std::string format = root_text(source, root, "format"); format != format_name) {
    source.fail("root attribute format", fmt::format("is \"{}\", not \"{}\"", format, format_name),
                "Give a run file of Diastole.");
  }
  const auto version = root.find("format_version");
  if (version == root.end() || std::holds_alternative<std::string>(version->second)) {
    source.fail("root attribute format_version", "is missing or not a number");
  }
  const double found = std::visit(
      [](const auto& value) {
        if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::string>) {
          return 0.0;
        } else {
          return static_cast<double>(value);
        }
      },
      version->second);
  if (!(found >= 1)) source.fail("root attribute format_version", fmt::format("is {}", found));
  if (found > static_cast<double>(format_version)) {
    source.fail("root attribute format_version",
                fmt::format("is {}, newer than the {} that this program reads", found, format_version),
                "Update Diastole.");
  }
}

/// The rows of a table, column by column.
template <typename Row>
std::vector<Row> read_table(const H5Source& source, const auto& table) {
  std::vector<Row> rows;
  const auto take = [&]<typename Value>(const Column<Row, Value>& column) {
    std::vector<Value> values;
    source.column(table.path, column.name, values);
    rows.resize(values.size());
    for (size_t i = 0; i < values.size(); ++i)
      rows[i].*column.member = std::move(values[i]);
  };
  std::apply([&](const auto&... column) { (take(column), ...); }, table.columns);
  return rows;
}

/// None unless all of it is there.
std::optional<StreamGrid> read_grid(const H5Source& source, const std::string& group) {
  const auto attributes = source.attributes(group);
  const auto number = [&](const char* name) -> std::optional<double> {
    const auto found = attributes.find(name);
    if (found == attributes.end()) return std::nullopt;
    if (const auto* value = std::get_if<double>(&found->second)) return *value;
    if (const auto* value = std::get_if<int64_t>(&found->second)) return static_cast<double>(*value);
    return std::nullopt;
  };
  const auto start_s = number(grid_start), end_s = number(grid_end), rate_Hz = number(grid_rate);
  if (!start_s || !end_s || !rate_Hz) return std::nullopt;
  return StreamGrid{*start_s, *end_s, *rate_Hz};
}

/// Each is open as long as the run is, with the library's index of it. A Modbus module has fewer inputs.
constexpr size_t most_channels = 256;

/// Without rows.
PressureTrace read_channels(const H5Source& source) {
  PressureTrace pressure;
  pressure.grid = read_grid(source, pressure_group);
  for (const std::string& name : source.children(pressure_group)) {
    if (unit_of(name) != pressure_unit) continue;
    const std::string dataset = fmt::format("{}/{}", pressure_group, name);
    pressure.channels[name];
    if (pressure.channels.size() > most_channels)
      source.fail(fmt::format("group {}", pressure_group),
                  fmt::format("has more than {} channels", most_channels),
                  "No instrument has as many: the file was damaged or made to do harm.");
    auto notes = source.attributes(dataset);
    if (const auto units = notes.find("units"); units != notes.end()) {
      const auto* stated = std::get_if<std::string>(&units->second);
      if (stated == nullptr || *stated != pressure_unit)
        source.fail(fmt::format("dataset {}, attribute units", dataset),
                    stated == nullptr ? "is no text" : fmt::format("is \"{}\"", *stated),
                    "Run files hold pressures in kPa: convert the values, and correct the attribute.");
      notes.erase(units);
    }
    if (!notes.empty()) pressure.notes[name] = std::move(notes);
  }
  if (!pressure.channels.contains("cavity_kPa")) {
    source.fail("dataset /pressure/cavity_kPa", "is missing", "The catheter's pressure must be there.");
  }
  return pressure;
}

/// The number that a group of one of `segments` segments is named by.
size_t segment_of(const H5Source& source, const std::string& group, const std::string& name,
                  size_t segments) {
  size_t segment = 0;
  const char* end = name.data() + name.size();
  if (const auto [read, error] = std::from_chars(name.data(), end, segment);
      read != end || error != std::errc()) {
    source.fail(fmt::format("group {}/{}", group, name), "is not named by a segment's number");
  }
  if (segment >= segments) {
    source.fail(fmt::format("group {}/{}", group, name),
                fmt::format("is of a segment that {} has not: it has {}", segments_table.path, segments),
                "Segments count from 0.");
  }
  return segment;
}

std::map<size_t, PlayedWaveform> read_waveforms(const H5Source& source, size_t segments) {
  std::map<size_t, PlayedWaveform> waveforms;
  for (const std::string& name : source.children(waveforms_group)) {
    const std::string group = fmt::format("{}/{}", waveforms_group, name);
    waveforms[segment_of(source, waveforms_group, name, segments)] = {source.text(group + "/points"),
                                                                      source.numbers(group + "/phase"),
                                                                      source.numbers(group + "/fraction")};
  }
  return waveforms;
}

std::map<size_t, FlowVolume> read_flow(const H5Source& source, size_t segments) {
  std::map<size_t, FlowVolume> flow;
  for (const std::string& name : source.children(flow_group)) {
    const std::string group = fmt::format("{}/{}", flow_group, name);
    flow[segment_of(source, flow_group, name, segments)] = {source.numbers(group + "/phase_s"),
                                                            source.numbers(group + "/cavity_mL"),
                                                            source.numbers(group + "/sigma_mL")};
  }
  return flow;
}

std::map<std::string, double, std::less<>> read_clock(const H5Source& source) {
  std::map<std::string, double, std::less<>> clock;
  for (const std::string& name : source.children(clock_group)) {
    clock[name] = source.scalar(fmt::format("{}/{}", clock_group, name));
  }
  return clock;
}

RecordedRun read_without_rows(const H5Source& source) {
  const auto root = source.attributes("/");
  expect_format(source, root);
  RecordedRun run;
  run.file = source.file();
  run.run_id = root_text(source, root, "run_id");
  run.started_utc = root_text(source, root, "started_utc");
  run.producer = root_text(source, root, "producer");
  run.rig = source.attributes(rig_group);
  run.protocol_toml = source.text(protocol_toml);
  run.segments = read_table<Segment>(source, segments_table);
  run.waveforms = read_waveforms(source, run.segments.size());
  run.pump.grid = read_grid(source, pump_group);
  run.pressure = read_channels(source);
  run.trigger_s = source.numbers(trigger_time);
  if (source.has(trigger_delay)) run.trigger_delay_s = source.scalar(trigger_delay);
  run.flow = read_flow(source, run.segments.size());
  run.clock = read_clock(source);
  if (source.has(slices_table.path)) run.slices = read_table<Slice>(source, slices_table);
  run.gaps = read_table<Gap>(source, gaps_table);
  run.events = read_table<Event>(source, events_table);
  return run;
}

}  // namespace

RecordedRun read_run(const std::filesystem::path& path) {
  const H5Source source(path);
  RecordedRun run = read_without_rows(source);
  run.pump.time_s = source.samples(pump_time);
  run.pump.commanded_mL = source.samples(pump_commanded);
  run.pressure.time_s = source.samples(pressure_time);
  for (auto& [name, values_kPa] : run.pressure.channels)
    values_kPa = source.samples(fmt::format("{}/{}", pressure_group, name));
  check(run);
  return run;
}

RunFile open_run(const std::filesystem::path& path) { return open_run(H5Source(path)); }

RunFile open_run(const H5Source& source) {
  RunFile file{read_without_rows(source), {}};
  file.rows.pump.time_s = source.series(pump_time);
  file.rows.pump.values["commanded_mL"] = source.series(pump_commanded);
  file.rows.pressure.time_s = source.series(pressure_time);
  for (const auto& [name, none] : file.run.pressure.channels)
    file.rows.pressure.values[name] = source.series(fmt::format("{}/{}", pressure_group, name));
  check(file.run, file.rows);
  return file;
}

}  // namespace diastole::runfile
