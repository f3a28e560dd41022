#include "host/runfile/writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <span>

#include "host/runfile/h5_sink.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
namespace {

template <typename Row>
auto column(const std::vector<Row>& rows, auto member) {
  std::vector<std::decay_t<decltype(rows.front().*member)>> values;
  for (const Row& row : rows)
    values.push_back(row.*member);
  return values;
}

void write_protocol(H5Sink& sink, const runfile::RecordedRun& run) {
  using runfile::Segment;
  sink.group(runfile::protocol_group);
  sink.text(runfile::protocol_toml, run.protocol_toml);
  sink.table(runfile::protocol_segments,
             {{"start_s", column(run.segments, &Segment::start_s)},
              {"waveform", column(run.segments, &Segment::waveform)},
              {"stroke_mL", column(run.segments, &Segment::stroke_mL)},
              {"period_s", column(run.segments, &Segment::period_s)},
              {"offset_mL", column(run.segments, &Segment::offset_mL)},
              {"cycles", column(run.segments, &Segment::cycles)}},
             runfile::segments_units);
  for (const auto& [segment, waveform] : run.waveforms) {
    const std::string group = fmt::format("{}/{}", runfile::waveforms_group, segment);
    sink.text(group + "/points", waveform.points);
    sink.numbers(group + "/phase", waveform.phase, "1");
    sink.numbers(group + "/fraction", waveform.fraction, "1");
  }
  if (run.slices.empty()) return;
  using runfile::Slice;
  sink.table(runfile::protocol_slices,
             {{"block", column(run.slices, &Slice::block)},
              {"slice", column(run.slices, &Slice::number)},
              {"first_trigger", column(run.slices, &Slice::first_trigger)},
              {"triggers", column(run.slices, &Slice::triggers)},
              {"cycles", column(run.slices, &Slice::cycles)},
              {"dummy_cycles", column(run.slices, &Slice::dummy_cycles)}},
             runfile::slices_units);
}

void write_streams(H5Sink& sink, const runfile::RecordedRun& run) {
  sink.numbers(runfile::pump_time, run.pump.time_s, runfile::time_unit);
  sink.numbers(runfile::pump_commanded, run.pump.commanded_mL, runfile::volume_unit);
  sink.numbers(runfile::pressure_time, run.pressure.time_s, runfile::time_unit);
  for (const auto& [name, values_kPa] : run.pressure.channels) {
    sink.numbers(fmt::format("{}/{}", runfile::pressure_group, name), values_kPa, runfile::pressure_unit);
  }
  for (const auto& [name, notes] : run.pressure.notes) {
    for (const auto& [note, value] : notes)
      sink.attribute(fmt::format("{}/{}", runfile::pressure_group, name), note, value);
  }
  sink.numbers(runfile::trigger_time, run.trigger_s, runfile::time_unit);
  if (run.trigger_delay_s > 0) sink.scalar(runfile::trigger_delay, run.trigger_delay_s, runfile::time_unit);
  for (const auto& [segment, flow] : run.flow) {
    const std::string group = fmt::format("{}/{}", runfile::flow_group, segment);
    sink.numbers(group + "/phase_s", flow.phase_s, runfile::time_unit);
    sink.numbers(group + "/cavity_mL", flow.cavity_mL, runfile::volume_unit);
    sink.numbers(group + "/sigma_mL", flow.sigma_mL, runfile::volume_unit);
  }
}

void write_tables(H5Sink& sink, const runfile::RecordedRun& run) {
  using runfile::Event;
  using runfile::Gap;
  sink.table(runfile::gaps_table,
             {{"stream", column(run.gaps, &Gap::stream)},
              {"first_index", column(run.gaps, &Gap::first_index)},
              {"count", column(run.gaps, &Gap::count)},
              {"reason", column(run.gaps, &Gap::reason)}},
             runfile::gaps_units);
  sink.table(runfile::events_table,
             {{"time_s", column(run.events, &Event::time_s)},
              {"level", column(run.events, &Event::level)},
              {"code", column(run.events, &Event::code)},
              {"text", column(run.events, &Event::text)}},
             runfile::events_units);
}

std::vector<std::byte> image_of(const std::filesystem::path& path, const runfile::RecordedRun& run) {
  H5Sink sink(path.string());
  sink.attribute("/", "format", std::string(runfile::format_name));
  sink.attribute("/", "format_version", runfile::format_version);
  sink.attribute("/", "run_id", run.run_id);
  sink.attribute("/", "started_utc", run.started_utc);
  sink.attribute("/", "producer", run.producer);
  sink.group(runfile::rig_group);
  for (const auto& [name, value] : run.rig)
    sink.attribute(runfile::rig_group, name, value);
  write_protocol(sink, run);
  write_streams(sink, run);
  if (!run.clock.empty()) sink.group(runfile::clock_group);
  for (const auto& [name, value] : run.clock) {
    sink.scalar(fmt::format("{}/{}", runfile::clock_group, name), value, std::string(runfile::unit_of(name)));
  }
  write_tables(sink, run);
  return sink.image();
}

void must(bool done, const std::filesystem::path& path, const char* what) {
  if (done) return;
  throw HardwareError(path.string(), fmt::format("{}: {}", what, std::strerror(errno)),
                      "Check the space on the disk and that you may write there.");
}

void write_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  must(file.valid(), path, "cannot be made");
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    must(written > 0, path, "cannot be written");
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  must(::fsync(file.get()) == 0, path, "cannot be brought to the disk");
}

void bring_to_disk(const std::filesystem::path& directory) {
  const Descriptor file(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  must(file.valid() && ::fsync(file.get()) == 0, directory, "cannot be brought to the disk");
}

}  // namespace

void write_run(const std::filesystem::path& path, const runfile::RecordedRun& run) {
  runfile::check(run);
  const std::filesystem::path temporary = fmt::format("{}.{}.part", path.string(), ::getpid());
  try {
    write_bytes(temporary, image_of(path, run));
    std::filesystem::rename(temporary, path);
    bring_to_disk(path.has_parent_path() ? path.parent_path() : ".");
  } catch (const std::filesystem::filesystem_error& error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw HardwareError(path.string(), error.what(), "Check that you may write there.");
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw;
  }
}

}  // namespace diastole
