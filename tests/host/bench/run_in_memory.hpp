#pragma once
// Whole runs in memory, from a journal and into a run file: product code streams their rows.

#include <fmt/format.h>

#include <span>
#include <vector>

#include "host/runfile/assemble.hpp"
#include "host/runfile/writer.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {

inline AssembledRun assemble_run(const JournalRecords& journal) {
  StreamedRun streamed = stream_run(journal);
  runfile::RecordedRun& run = streamed.assembled.run;
  streamed.pump.each([&](size_t column, std::span<const double> values) {
    std::vector<double>& target = column == 0 ? run.pump.time_s : run.pump.commanded_mL;
    target.insert(target.end(), values.begin(), values.end());
  });
  std::vector<std::vector<double>*> targets;
  for (const RowColumn& column : streamed.pressure.columns) {
    const std::string name = column.path.substr(column.path.rfind('/') + 1);
    targets.push_back(targets.empty() ? &run.pressure.time_s : &run.pressure.channels[name]);
    if (!column.notes.empty()) run.pressure.notes[name] = column.notes;
  }
  streamed.pressure.each([&](size_t column, std::span<const double> values) {
    targets[column]->insert(targets[column]->end(), values.begin(), values.end());
  });
  return std::move(streamed.assembled);
}

inline AssembledRun assemble_run(const JournalContents& journal) {
  return assemble_run(JournalRecords(journal));
}

/// Columns that are in memory, all at once.
inline RowStream stream_of(std::vector<RowColumn> columns, std::vector<std::span<const double>> values) {
  RowStream stream{values.front().size(), std::move(columns), {}};
  stream.each = [values = std::move(values)](const RowStream::Take& take) {
    for (size_t column = 0; column < values.size(); ++column)
      take(column, values[column]);
  };
  return stream;
}

inline RowStream stream_of(const runfile::PumpTrace& pump) {
  return stream_of(
      {{runfile::pump_time, runfile::time_unit}, {runfile::pump_commanded, runfile::volume_unit}},
      {pump.time_s, pump.commanded_mL});
}

inline RowStream stream_of(const runfile::PressureTrace& pressure) {
  std::vector<RowColumn> columns{{runfile::pressure_time, runfile::time_unit}};
  std::vector<std::span<const double>> values{pressure.time_s};
  for (const auto& [name, values_kPa] : pressure.channels) {
    columns.push_back({fmt::format("{}/{}", runfile::pressure_group, name), runfile::pressure_unit});
    if (const auto notes = pressure.notes.find(name); notes != pressure.notes.end())
      columns.back().notes = notes->second;
    values.emplace_back(values_kPa);
  }
  return stream_of(std::move(columns), std::move(values));
}

/// Throws as runfile::check.
inline std::string write_run(const std::filesystem::path& path, const runfile::RecordedRun& run,
                             const FlushDirectory& flush_directory = ::fsync) {
  runfile::check(run);
  StreamedRun streamed;
  streamed.assembled.run = run;
  streamed.pump = stream_of(run.pump);
  streamed.pressure = stream_of(run.pressure);
  return write_run(path, streamed, flush_directory);
}

}  // namespace diastole
