// Run files that are sound as HDF5 and say anything: objects left out, of another kind or another length, any
// numbers in them. What is read keeps every rule of `check` and bears what `inspect` and `bin` do with it; what is not
// is refused with InputError.
//
// The bytes of the file itself are not damaged: how the HDF5 library bears that is the library's affair.
//
//   input: for every object below, and for every column of a table, how it is written (1 byte, see `Way`)
//          and what that takes: sizes and values, each as its first byte says
//   An input that ends early, and so the empty one, leaves the rest as it should be.

#include <fcntl.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "host/runfile/h5_sink.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/soundness.hpp"
#include "tests/host/bench/scratch.hpp"

namespace {

using namespace diastole;
using Numbers = std::vector<double>;
using Integers = std::vector<int64_t>;
using Texts = std::vector<std::string>;

enum class Way : uint8_t { as_it_should_be, left_out, numbers, integers, texts, scalar, text, group };

class ByteReader {
 public:
  explicit ByteReader(std::span<const uint8_t> bytes) : left_(bytes) {}

  uint8_t byte() {
    if (left_.empty()) return 0;
    const uint8_t first = left_[0];
    left_ = left_.subspan(1);
    return first;
  }
  Way way() { return static_cast<Way>(byte() % 8); }

  /// Small numbers mostly, those at the edges, or any eight bytes.
  double number() {
    static constexpr double edges[] = {std::numeric_limits<double>::quiet_NaN(),
                                       std::numeric_limits<double>::infinity(),
                                       -1,
                                       0,
                                       1e300,
                                       -1e300,
                                       1e-300,
                                       1e10};
    const uint8_t kind = byte();
    if (kind < 160) return 0.05 * kind;
    if (kind < 200) return edges[kind % 8];
    return raw<double>();
  }
  int64_t integer() {
    static constexpr int64_t edges[] = {-1, std::numeric_limits<int64_t>::max(),
                                        std::numeric_limits<int64_t>::min(), 1'000'000'000'000};
    const uint8_t kind = byte();
    if (kind < 200) return kind % 32;
    if (kind < 230) return edges[kind % 4];
    return raw<int64_t>();
  }
  std::string text() {
    static constexpr const char* known[] = {"parabolic", "hold", "pressure", "pressure/cavity_kPa",
                                            "trigger",   "pump", "error",    "stopped_now"};
    const uint8_t kind = byte();
    if (kind < 128) return known[kind % 8];
    std::string any;
    for (unsigned i = 0; i < kind % 16; ++i)
      any.push_back(static_cast<char>(byte()));
    return any;
  }
  Numbers numbers(size_t rows) {
    Numbers values(rows);
    for (double& value : values)
      value = number();
    return values;
  }
  Integers integers(size_t rows) {
    Integers values(rows);
    for (int64_t& value : values)
      value = integer();
    return values;
  }
  Texts texts(size_t rows) {
    Texts values(rows);
    for (std::string& value : values)
      value = text();
    return values;
  }

 private:
  template <typename Value>
  Value raw() {
    std::array<uint8_t, sizeof(Value)> bytes{};
    for (uint8_t& each : bytes)
      each = byte();
    Value value;
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::span<const uint8_t> left_;
};

/// Of pressures, the only datasets of which the reader asks it.
const char* unit(const std::string& path) { return path.ends_with("_kPa") ? "kPa" : "1"; }

class Author {
 public:
  Author(std::span<const uint8_t> bytes, int descriptor)
      : input_(bytes), disk_(descriptor), sink_("fuzz", disk_) {}

  void attribute(const char* object, const std::string& name, const runfile::Attribute& usual) {
    switch (input_.way()) {
      case Way::left_out:
        return;
      case Way::numbers:
        return sink_.attribute(object, name, input_.number());
      case Way::integers:
        return sink_.attribute(object, name, input_.integer());
      case Way::texts:
        return sink_.attribute(object, name, input_.text());
      default:
        return sink_.attribute(object, name, usual);
    }
  }

  /// `usual` writes the object as it should be.
  void object(const std::string& path, const auto& usual) {
    switch (input_.way()) {
      case Way::as_it_should_be:
        return usual();
      case Way::left_out:
        return;
      case Way::numbers:
        return sink_.numbers(path, input_.numbers(input_.byte() % 16), unit(path));
      case Way::integers:
        return sink_.table(path, {{"cycles", input_.integers(input_.byte() % 4)}}, "1");
      case Way::texts:
        return sink_.table(path, {{"text", input_.texts(input_.byte() % 4)}}, "1");
      case Way::scalar:
        return sink_.scalar(path, input_.number(), unit(path));
      case Way::text:
        return sink_.text(path, input_.text());
      case Way::group:
        return sink_.group(path);
    }
  }
  void numbers(const std::string& path, const Numbers& usual) {
    object(path, [&] { sink_.numbers(path, usual, unit(path)); });
  }
  void scalar(const std::string& path, double usual) {
    object(path, [&] { sink_.scalar(path, usual, unit(path)); });
  }
  void group(const std::string& path) {
    object(path, [&] { sink_.group(path); });
  }
  void text(const std::string& path, const std::string& usual) {
    object(path, [&] { sink_.text(path, usual); });
  }
  /// Columns, too, may be left out or of another kind; all are then as long as told, or as the usual ones.
  void table(const std::string& path, std::vector<TableColumn> columns) {
    object(path, [&] {
      const uint8_t asked = input_.byte();
      const size_t usual_rows =
          std::visit([](const auto& values) { return values.size(); }, columns[0].values);
      const size_t rows = asked == 0 ? usual_rows : asked % 5;
      std::vector<TableColumn> written;
      for (TableColumn& column : columns)
        rewrite(column, rows, written);
      if (!written.empty()) sink_.table(path, written, "1");
    });
  }
  void finish() { sink_.finish(); }

 private:
  void rewrite(TableColumn& column, size_t rows, std::vector<TableColumn>& written) {
    switch (input_.way()) {
      case Way::left_out:
        return;
      case Way::numbers:
        column.values = input_.numbers(rows);
        break;
      case Way::integers:
        column.values = input_.integers(rows);
        break;
      case Way::texts:
        column.values = input_.texts(rows);
        break;
      default:
        std::visit([rows](auto& values) { values.resize(rows); }, column.values);
    }
    written.push_back(std::move(column));
  }

  ByteReader input_;
  H5Disk disk_;
  H5Sink sink_;
};

Numbers even(size_t rows, double step_s) {
  Numbers times_s;
  for (size_t row = 0; row < rows; ++row)
    times_s.push_back(step_s * static_cast<double>(row));
  return times_s;
}

/// Two segments of two cycles, of which the second was played from points.
void write(std::span<const uint8_t> bytes, int descriptor) {
  Author author(bytes, descriptor);
  author.attribute("/", "format", std::string(runfile::format_name));
  author.attribute("/", "format_version", runfile::format_version);
  for (const char* name : {"run_id", "started_utc", "producer"})
    author.attribute("/", name, std::string("x"));
  author.group(runfile::rig_group);
  author.numbers(runfile::pressure_time, even(33, 0.125));
  author.numbers("/pressure/cavity_kPa", Numbers(33, 1.5));
  author.numbers(runfile::trigger_time, {0, 1, 2, 3});
  author.table(runfile::segments_table.path, {{"start_s", Numbers{0, 2}},
                                              {"waveform", Texts{"parabolic", "uploaded"}},
                                              {"stroke_mL", Numbers{10, 10}},
                                              {"period_s", Numbers{1, 1}},
                                              {"offset_mL", Numbers{0, 0}},
                                              {"cycles", Integers{2, 2}}});
  author.table(runfile::slices_table.path, {{"block", Texts{"tagged", "tagged"}},
                                            {"slice", Integers{0, 1}},
                                            {"first_trigger", Integers{0, 2}},
                                            {"triggers", Integers{2, 2}},
                                            {"cycles", Integers{2, 2}},
                                            {"dummy_cycles", Integers{0, 0}}});
  author.table(runfile::gaps_table.path, {{"stream", Texts{"pressure"}},
                                          {"first_index", Integers{3}},
                                          {"count", Integers{1}},
                                          {"reason", Texts{"no answer"}}});
  author.table(
      runfile::events_table.path,
      {{"time_s", Numbers{0}}, {"level", Texts{"info"}}, {"code", Texts{"x"}}, {"text", Texts{"x"}}});
  author.scalar(runfile::trigger_delay, 0.1);
  author.scalar("/clock/daq_drift_ppm", 20);
  author.numbers(runfile::pump_time, even(9, 0.5));
  author.numbers(runfile::pump_commanded, Numbers(9, 3));
  author.numbers("/mr/flow/0/phase_s", {0, 0.5});
  author.numbers("/mr/flow/0/cavity_mL", {40, 50});
  author.numbers("/mr/flow/0/sigma_mL", {1, 1});
  author.text("/protocol/waveforms/1/points", "x");
  author.numbers("/protocol/waveforms/1/phase", {0, 0.5, 1});
  author.numbers("/protocol/waveforms/1/fraction", {0, 1, 0});
  author.text(runfile::protocol_toml, "x");
  author.finish();
}

void use(const runfile::RecordedRun& run) {
  (void)runfile::assess(run);
  for (const int64_t gate_every : {1, 2}) {
    try {
      (void)runfile::bin_frames(run, {.frames = 4, .gate_every = gate_every});
    } catch (const InputError&) {
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const Scratch scratch("fuzz");
  const std::filesystem::path file = scratch / "fuzzed.run.h5";
  std::filesystem::remove(
      file);  // a new one each time: some file systems bring one that is truncated to the disk
  try {
    const Descriptor opened(::open(file.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
    write({data, size}, opened.get());
  } catch (const HardwareError&) {
    return 0;  // a dataset where a group is needed, say
  }
  try {
    use(runfile::read_run(file));
  } catch (const InputError& error) {
    if (size > 0) return 0;
    std::fputs(error.what(), stderr);  // nothing was asked for that could be refused
    std::abort();
  }
  return 0;
}
