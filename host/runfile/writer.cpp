#include "host/runfile/writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "host/journal/part_file.hpp"
#include "host/runfile/h5_sink.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/note_writer.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
namespace {

template <typename Row>
void write_table(H5Sink& sink, const std::vector<Row>& rows, const auto& table) {
  std::vector<TableColumn> columns;
  const auto put = [&]<typename Value>(const runfile::Column<Row, Value>& column) {
    std::vector<Value> values;
    for (const Row& row : rows)
      values.push_back(row.*column.member);
    columns.push_back({column.name, std::move(values)});
  };
  std::apply([&](const auto&... column) { (put(column), ...); }, table.columns);
  sink.table(table.path, columns, table.units);
}

void write_protocol(H5Sink& sink, const runfile::RecordedRun& run) {
  sink.group(runfile::protocol_group);
  sink.text(runfile::protocol_toml, run.protocol_toml);
  write_table(sink, run.segments, runfile::segments_table);
  for (const auto& [segment, waveform] : run.waveforms) {
    const std::string group = fmt::format("{}/{}", runfile::waveforms_group, segment);
    sink.text(group + "/points", waveform.points);
    sink.numbers(group + "/phase", waveform.phase, "1");
    sink.numbers(group + "/fraction", waveform.fraction, "1");
  }
  if (!run.slices.empty()) write_table(sink, run.slices, runfile::slices_table);
}

void write_triggers(H5Sink& sink, const runfile::RecordedRun& run) {
  sink.numbers(runfile::trigger_time, run.trigger_s, runfile::time_unit);
  if (run.trigger_delay_s > 0) sink.scalar(runfile::trigger_delay, run.trigger_delay_s, runfile::time_unit);
  for (const auto& [segment, flow] : run.flow) {
    const std::string group = fmt::format("{}/{}", runfile::flow_group, segment);
    sink.numbers(group + "/phase_s", flow.phase_s, runfile::time_unit);
    sink.numbers(group + "/cavity_mL", flow.cavity_mL, runfile::volume_unit);
    sink.numbers(group + "/sigma_mL", flow.sigma_mL, runfile::volume_unit);
  }
}

void write_grid(H5Sink& sink, const char* group, const std::optional<runfile::StreamGrid>& grid) {
  if (!grid) return;
  sink.attribute(group, runfile::grid_start, grid->start_s);
  sink.attribute(group, runfile::grid_end, grid->end_s);
  sink.attribute(group, runfile::grid_rate, grid->rate_Hz);
}

void write_session(H5Sink& sink, const runfile::Session& session) {
  if (session.empty()) return;
  sink.group(runfile::session_group);
  for (const auto& [name, value] : session.facts)
    sink.attribute(runfile::session_group, name, value);
  for (size_t i = 0; i < session.notes.size(); ++i) {
    const std::string note = runfile::note_path(i + 1);
    sink.text(note, session.notes[i].text);
    sink.attribute(note, runfile::note_written, session.notes[i].written_utc);
    sink.attribute(note, runfile::note_author, session.notes[i].author);
  }
}

/// What a file holds: `run` without its rows, and these.
struct Content {
  const runfile::RecordedRun& run;
  const runfile::Session& session;
  const RowStream& pump;
  const RowStream& pressure;
};

void write_content(H5Sink& sink, const Content& content) {
  const runfile::RecordedRun& run = content.run;
  sink.attribute("/", "format", std::string(runfile::format_name));
  sink.attribute("/", "format_version", runfile::format_version);
  sink.attribute("/", "run_id", run.run_id);
  sink.attribute("/", "started_utc", run.started_utc);
  sink.attribute("/", "producer", run.producer);
  sink.group(runfile::rig_group);
  for (const auto& [name, value] : run.rig)
    sink.attribute(runfile::rig_group, name, value);
  write_protocol(sink, run);
  sink.rows(content.pump);
  sink.rows(content.pressure);
  write_grid(sink, runfile::pump_group, run.pump.grid);
  write_grid(sink, runfile::pressure_group, run.pressure.grid);
  write_triggers(sink, run);
  if (!run.clock.empty()) sink.group(runfile::clock_group);
  for (const auto& [name, value] : run.clock) {
    sink.scalar(fmt::format("{}/{}", runfile::clock_group, name), value, std::string(runfile::unit_of(name)));
  }
  write_session(sink, content.session);
  write_table(sink, run.gaps, runfile::gaps_table);
  write_table(sink, run.events, runfile::events_table);
}

void must(bool done, const std::filesystem::path& path, const char* what) {
  if (done) return;
  throw HardwareError(path.string(), fmt::format("{}: {}", what, std::strerror(errno)),
                      "Check the space on the disk and that you may write there.");
}

void write_file(const std::filesystem::path& file, const std::filesystem::path& path,
                const Content& content) {
  const Descriptor opened(::open(file.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  must(opened.valid(), path, "cannot be made");
  H5Disk disk(opened.get());
  H5Sink sink(path.string(), disk);
  write_content(sink, content);
  sink.finish();
  must(::fsync(opened.get()) == 0, path, "cannot be brought to the disk");
}

/// What is to be reported when the disk does not confirm the file's name.
std::string confirm_name(const std::filesystem::path& path, const FlushDirectory& flush_directory) {
  const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
  const Descriptor directory(::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.valid() && flush_directory(directory.get()) == 0) return {};
  return fmt::format(
      "{} is whole, but the disk has not confirmed its name ({}): after a power cut it may be missing there",
      path.string(), std::strerror(errno));
}

std::string write_content(const std::filesystem::path& path, const Content& content,
                          const FlushDirectory& flush_directory) {
  remove_leftovers(path);
  try {
    write_whole(path, [&](const std::filesystem::path& part) { write_file(part, path, content); });
  } catch (const std::filesystem::filesystem_error& error) {
    throw HardwareError(path.string(), error.what(), "Check that you may write there.");
  }
  return confirm_name(path, flush_directory);
}

}  // namespace

std::string write_run(const std::filesystem::path& path, const StreamedRun& run,
                      const FlushDirectory& flush_directory) {
  runfile::check(run.assembled.run);
  return write_content(path, {run.assembled.run, run.assembled.session, run.pump, run.pressure},
                       flush_directory);
}

}  // namespace diastole
