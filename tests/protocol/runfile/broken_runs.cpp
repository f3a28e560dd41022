#include "tests/protocol/runfile/broken_runs.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>

#include <array>
#include <cstring>

#include "tests/host/bench/scratch.hpp"

namespace diastole::runfile {
namespace {

constexpr size_t text_size = 24;

struct Writer {
  hid_t file;
  const RunSketch& sketch;

  [[nodiscard]] hid_t text_type() const {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, sketch.variable_length_texts ? H5T_VARIABLE : text_size);
    H5Tset_cset(type, H5T_CSET_UTF8);
    if (!sketch.variable_length_texts) H5Tset_strpad(type, H5T_STR_NULLPAD);
    return type;
  }

  /// What H5Dwrite and H5Awrite expect for one text: the characters, or a pointer to them.
  void with_text(const std::string& value, auto&& write) const {
    const char* pointer = value.c_str();
    std::array<char, text_size> fixed{};
    std::memcpy(fixed.data(), value.data(), std::min(value.size(), text_size));
    const hid_t type = text_type();
    write(type, sketch.variable_length_texts ? static_cast<const void*>(&pointer) : fixed.data());
    H5Tclose(type);
  }

  void attribute(hid_t object, const char* name, const std::string& value) const {
    with_text(value, [&](hid_t type, const void* bytes) {
      const hid_t space = H5Screate(H5S_SCALAR);
      const hid_t id = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
      H5Awrite(id, type, bytes);
      H5Aclose(id);
      H5Sclose(space);
    });
  }

  void attribute(hid_t object, const char* name, long long value) const {
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t id = H5Acreate2(object, name, H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(id, H5T_NATIVE_LLONG, &value);
    H5Aclose(id);
    H5Sclose(space);
  }

  void dataset(const char* path, hid_t type, hsize_t rows, const void* bytes, bool scalar = false) const {
    if (sketch.leave_out == path) return;
    const hid_t links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    const hid_t space = scalar ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &rows, nullptr);
    const hid_t id = H5Dcreate2(file, path, type, space, links, H5P_DEFAULT, H5P_DEFAULT);
    if (rows > 0) H5Dwrite(id, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes);
    H5Dclose(id);
    H5Sclose(space);
    H5Pclose(links);
  }

  void numbers(const char* path, const std::vector<double>& values) const {
    dataset(path, H5T_NATIVE_DOUBLE, values.size(), values.data());
  }
};

struct SegmentRow {
  double start_s;
  char waveform[text_size];
  double stroke_mL, period_s, offset_mL;
  int cycles;
};

hid_t segment_type() {
  const hid_t text = H5Tcopy(H5T_C_S1);
  H5Tset_size(text, text_size);
  const hid_t row = H5Tcreate(H5T_COMPOUND, sizeof(SegmentRow));
  H5Tinsert(row, "start_s", HOFFSET(SegmentRow, start_s), H5T_NATIVE_DOUBLE);
  H5Tinsert(row, "waveform", HOFFSET(SegmentRow, waveform), text);
  H5Tinsert(row, "stroke_mL", HOFFSET(SegmentRow, stroke_mL), H5T_NATIVE_DOUBLE);
  H5Tinsert(row, "period_s", HOFFSET(SegmentRow, period_s), H5T_NATIVE_DOUBLE);
  H5Tinsert(row, "offset_mL", HOFFSET(SegmentRow, offset_mL), H5T_NATIVE_DOUBLE);
  H5Tinsert(row, "cycles", HOFFSET(SegmentRow, cycles), H5T_NATIVE_INT);
  H5Tclose(text);
  return row;
}

/// The same bytes serve both text kinds: `stream` and `reason` are pointers in memory, and HDF5 cannot
/// convert those to fixed texts, so this table is always of variable length.
struct GapBytes {
  const char* stream;
  long long first_index, count;
  const char* reason;
};

hid_t gap_type() {
  const hid_t text = H5Tcopy(H5T_C_S1);
  H5Tset_size(text, H5T_VARIABLE);
  const hid_t row = H5Tcreate(H5T_COMPOUND, sizeof(GapBytes));
  H5Tinsert(row, "stream", HOFFSET(GapBytes, stream), text);
  H5Tinsert(row, "first_index", HOFFSET(GapBytes, first_index), H5T_NATIVE_LLONG);
  H5Tinsert(row, "count", HOFFSET(GapBytes, count), H5T_NATIVE_LLONG);
  H5Tinsert(row, "reason", HOFFSET(GapBytes, reason), text);
  H5Tclose(text);
  return row;
}

struct EventBytes {
  double time_s;
  char level[text_size], code[text_size], text[text_size];
};

hid_t event_type() {
  const hid_t text = H5Tcopy(H5T_C_S1);
  H5Tset_size(text, text_size);
  const hid_t row = H5Tcreate(H5T_COMPOUND, sizeof(EventBytes));
  H5Tinsert(row, "time_s", HOFFSET(EventBytes, time_s), H5T_NATIVE_DOUBLE);
  H5Tinsert(row, "level", HOFFSET(EventBytes, level), text);
  H5Tinsert(row, "code", HOFFSET(EventBytes, code), text);
  H5Tinsert(row, "text", HOFFSET(EventBytes, text), text);
  H5Tclose(text);
  return row;
}

}  // namespace

void write_sketch(const std::filesystem::path& path, const RunSketch& sketch) {
  const Writer writer{H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), sketch};
  ASSERT_GE(writer.file, 0) << path;
  writer.attribute(writer.file, "format", sketch.format);
  writer.attribute(writer.file, "format_version", sketch.format_version);
  writer.attribute(writer.file, "run_id", std::string("00000000-0000"));
  writer.attribute(writer.file, "started_utc", std::string("2026-01-02T03:04:05Z"));
  writer.attribute(writer.file, "producer", std::string("a test"));
  const hid_t rig = H5Gcreate2(writer.file, "/rig", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  writer.attribute(rig, "microsteps", 8LL);
  writer.attribute(rig, "specimen", std::string("gel"));
  H5Gclose(rig);
  writer.with_text("# experiment", [&](hid_t type, const void* bytes) {
    writer.dataset("/protocol/toml", type, 1, bytes, true);
  });
  const SegmentRow segment{0.5, "parabolic", 10, 2, 0, 1};
  const hid_t segments = segment_type();
  writer.dataset("/protocol/segments", segments, 1, &segment);
  H5Tclose(segments);
  writer.numbers("/pump/time_s", sketch.pump_time_s);
  writer.numbers("/pump/commanded_mL", sketch.commanded_mL);
  writer.numbers("/pressure/time_s", sketch.pressure_time_s);
  writer.numbers("/pressure/cavity_kPa", sketch.cavity_kPa);
  if (const hid_t cavity = H5Dopen2(writer.file, "/pressure/cavity_kPa", H5P_DEFAULT); cavity >= 0) {
    writer.attribute(cavity, "units", sketch.cavity_units);
    H5Dclose(cavity);
  }
  writer.numbers("/trigger/time_s", sketch.trigger_s);
  std::vector<GapBytes> gaps;
  for (const GapRow& gap : sketch.gaps) {
    gaps.push_back({gap.stream.c_str(), gap.first_index, gap.count, "planted"});
  }
  const hid_t gap = gap_type();
  writer.dataset("/gaps", gap, gaps.size(), gaps.data());
  H5Tclose(gap);
  const EventBytes event{0.5, "info", "trigger", "first"};
  const hid_t events = event_type();
  writer.dataset("/events", events, 1, &event);
  H5Tclose(events);
  H5Fclose(writer.file);
}

std::filesystem::path scratch_file(const std::string& name) {
  static const Scratch directory("test-runfile");
  return directory / name;
}

}  // namespace diastole::runfile
