#include "estimator/law_fit/bench_test.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "estimator/io/number_table.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/shear/shear_test.hpp"
#include "protocol/contract/angle.hpp"
#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

constexpr std::string_view fibre_column = "fibre_deg";
constexpr size_t fewest_readings = 3;
constexpr double least_stretch = 0.05,
                 most_stretch = 20;  // beyond them nothing incompressible was ever tested

std::string_view header_of(std::string_view text) {
  text = without_byte_order_mark(text);
  return text.substr(0, text.find_first_of("\r\n"));
}

const TestKind& kind_of(std::string_view text, const std::string& file) {
  const std::string_view header = header_of(text);
  const std::string_view first = header.substr(0, header.find(','));
  const auto found =
      std::ranges::find_if(test_kinds(), [&](const TestKind& kind) { return kind.columns[0] == first; });
  if (found != test_kinds().end()) return *found;
  std::vector<std::string> known;
  for (const TestKind& kind : test_kinds())
    known.push_back(fmt::format("\n  {:<17} {}", kind.name, fmt::join(kind.columns, ",")));
  throw InputError(
      {file, "line 1", fmt::format("the column \"{}\" begins the header of no bench test", first),
       fmt::format(
           "{}The header must be one of:{}",
           first.find(';') != first.npos ? "Columns are separated by commas, and decimals have points. " : "",
           fmt::join(known, ""))});
}

/// Those of the kind that the header names, and where the fibre lies.
std::vector<std::string_view> columns_of(const TestKind& kind, std::string_view text) {
  const std::string header = fmt::format(",{},", header_of(text));
  std::vector<std::string_view> columns;
  for (size_t i = 0; i < kind.columns.size(); ++i) {
    if (i < kind.needed || header.find(fmt::format(",{},", kind.columns[i])) != header.npos)
      columns.push_back(kind.columns[i]);
  }
  if (header.find(fmt::format(",{},", fibre_column)) != header.npos) columns.push_back(fibre_column);
  return columns;
}

void check_lengths(const NumberTable& table, size_t row, std::span<const std::string_view> columns) {
  for (size_t i = 0; i < columns.size(); ++i) {
    const double value = table.at(row, i);
    const bool is_stretch = columns[i].find("stretch") != std::string_view::npos;
    if (is_stretch && (value < least_stretch || value > most_stretch)) {
      table.fail(row, i, fmt::format("{} is no stretch", value),
                 "Give the length over the unloaded length: 1.1 for ten percent longer.");
    }
    if (columns[i].ends_with("_mm") && value <= 0)
      table.fail(row, i, fmt::format("{} is not a length above zero", value), "Give it in mm.");
  }
}

void check_tube(const NumberTable& table, size_t row, std::span<const double> controls) {
  if (controls[0] >= controls[1]) {
    table.fail(
        row, 0,
        fmt::format("the inner radius {} mm is not below the outer radius {} mm", controls[0], controls[1]),
        "Give the unloaded tube's inner and outer radius: half of its diameters.");
  }
  if (tube_inner_radius2_mm2(controls) > 0) return;
  const double least_mm = std::sqrt((controls[1] * controls[1] - controls[0] * controls[0]) / controls[2]);
  table.fail(row, 3,
             fmt::format("an outer radius of {} mm leaves no hole: the wall alone fills {:.4g} mm",
                         controls[3], least_mm),
             "Give the outer radius under load, and the unloaded radii of the same tube.");
}

double fibre_rad_of(const NumberTable& table, size_t row, size_t column, const TestKind& kind) {
  const double fibre_deg = table.at(row, column);
  if (std::abs(fibre_deg) > 180)
    table.fail(row, column, fmt::format("{} is no direction", fibre_deg),
               "Give degrees, between -180 and 180.");
  if (kind.name == "uniaxial" && std::remainder(fibre_deg, 90) != 0) {
    table.fail(row, column,
               fmt::format("a fibre at {} degrees to the pull: the specimen would shear", fibre_deg),
               "Pull along the fibre (0) or across it (90), or give a biaxial test.");
  }
  return fibre_deg * rad_per_deg;
}

void measure_channels(BenchTest& test) {
  for (size_t i = 0; i < test.channels.size(); ++i) {
    double squares = 0;
    for (const Reading& reading : test.readings)
      squares += reading.measured[i] * reading.measured[i];
    test.channels[i].rms = std::sqrt(squares / static_cast<double>(test.readings.size()));
    if (test.channels[i].rms > 0) continue;
    throw InputError({test.file, fmt::format("column {}", test.channels[i].name), "every value is zero",
                      "Give what was measured under load."});
  }
}

/// What is at rest when unloaded is longer where it is pulled and shorter where it is pushed.
void check_signs(const BenchTest& test) {
  if (test.kind->name != "uniaxial" && test.kind->name != "planar") return;
  double product = 0;
  for (const Reading& reading : test.readings)
    product += (reading.controls[0] - 1) * reading.measured[0];
  if (product >= 0) return;
  const std::string_view stretch = test.kind->columns[0];
  throw InputError({test.file, fmt::format("column {}", stretch),
                    "the specimen is shorter where it is pulled, or longer where it is pushed",
                    fmt::format("{} is the length over the unloaded length (1 + strain: 1.1 for ten percent "
                                "longer), and {} is below zero in compression.",
                                stretch, test.kind->columns[1])});
}

BenchTest of_rotational_shear(std::string_view text, const std::string& file, const TestKind& kind) {
  BenchTest test{file, &kind, false, {{std::string(kind.columns[kind.controls]), 0}}, {}};
  for (const ShearRow& row : shear_test_from_text(text, file).rows) {
    test.readings.push_back({{row.annulus.inner_radius_mm, row.annulus.outer_radius_mm, row.annulus.height_mm,
                              row.moment_Nmm, row.radius_mm},
                             {row.rotation_rad / rad_per_deg}});
  }
  return test;
}

BenchTest of_table(std::string_view text, const std::string& file, const TestKind& kind) {
  const std::vector<std::string_view> columns = columns_of(kind, text);
  const NumberTable table = NumberTable::from_text(text, file, columns);
  table.expect_measurable();
  const auto set = std::span(columns).first(kind.controls);
  BenchTest test{file, &kind, columns.back() == fibre_column, {}, {}};
  const size_t end = columns.size() - (test.has_fibre ? 1 : 0);
  for (size_t i = kind.controls; i < end; ++i)
    test.channels.push_back({std::string(columns[i]), 0});
  for (size_t row = 0; row < table.rows(); ++row) {
    check_lengths(table, row, set);
    Reading& reading = test.readings.emplace_back();
    for (size_t i = 0; i < end; ++i)
      (i < kind.controls ? reading.controls : reading.measured).push_back(table.at(row, i));
    if (kind.name == "tube") check_tube(table, row, reading.controls);
    if (test.has_fibre) reading.fibre_rad = fibre_rad_of(table, row, end, kind);
  }
  if (test.readings.size() < fewest_readings) {
    throw InputError({file, "", fmt::format("{} rows show no curve", test.readings.size()),
                      fmt::format("Give {} readings or more.", fewest_readings)});
  }
  return test;
}

}  // namespace

BenchTest read_bench_test(const std::filesystem::path& path) {
  return bench_test_from_text(read_whole_file(path), path.string());
}

BenchTest bench_test_from_text(std::string_view text, const std::string& file) {
  if (text.find_first_not_of(" \t\r\n") == text.npos)
    throw InputError(
        {file, "", "the file is empty", "It must hold a header and three rows or more; see docs/law.md."});
  if (is_hdf5(text))
    throw InputError({file, "",
                      "is an HDF5 file such as a run file, but a table of a bench test is expected here",
                      "Give its CSV file; see docs/law.md."});
  const TestKind& kind = kind_of(text, file);
  BenchTest test =
      is_shear_test(header_of(text)) ? of_rotational_shear(text, file, kind) : of_table(text, file, kind);
  measure_channels(test);
  check_signs(test);
  return test;
}

}  // namespace diastole
