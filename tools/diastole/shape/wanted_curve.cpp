#include "tools/diastole/shape/wanted_curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "host/config/even_waveform.hpp"
#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::shaping {
namespace {

/// What either the points or an option states.
double stated(const WantedOptions& options, const std::optional<double>& in_file, const char* column,
              const std::optional<double>& given, const char* option) {
  const std::string place = std::string("option ") + option;
  if (in_file && given) {
    throw InputError({options.file.string(), place,
                      fmt::format("is {:g}, and the file's column {} says {:g}", *given, column, *in_file),
                      "Leave the option out, or give points without that column."});
  }
  if (!in_file && !given) {
    throw InputError({options.file.string(), place,
                      fmt::format("is missing, and the file has no column {}", column),
                      fmt::format("Give {}, or points with that column.", option)});
  }
  return given ? *given : *in_file;
}

double period_of(const WantedOptions& options, const PointsFile& points) {
  constexpr double shortest_s = 0.1;   // two harmonics below the 20 Hz up to which drives are shaped
  constexpr double longest_s = 600.0;  // the controller's
  const double period_s = stated(options, points.cycle_s, "time_s", options.period_s, "--period-s");
  if (period_s >= shortest_s && period_s <= longest_s) return period_s;
  throw InputError({options.file.string(), points.cycle_s ? "column time_s" : "option --period-s",
                    fmt::format("is a cycle of {:g} s, and a cycle lasts from {:g} to {:g} s", period_s,
                                shortest_s, longest_s),
                    "Give times in seconds."});
}

}  // namespace

WantedCurve read_wanted_curve(const WantedOptions& options) {
  constexpr Eigen::Index harmonics = 96;
  constexpr size_t phases = 2048;
  WantedCurve wanted;
  const PointsFile points = parse_points(read_bounded_file(options.file, most_table_bytes),
                                         options.file.string(), PointsOf::volume_or_pressure);
  wanted.is_pressure = points.range_kPa.has_value();
  const double period_s = period_of(options, points);
  const double range =
      wanted.is_pressure ? stated(options, points.range_kPa, "pressure_kPa", options.stroke_mL, "--stroke-mL")
                         : stated(options, points.range_mL, "volume_mL", options.stroke_mL, "--stroke-mL");
  std::vector<double> values = curve_at_even_phases(points, phases);
  for (double& value : values)
    value = options.least + range * value;
  wanted.curve = periodic_curve(values, period_s, harmonics);
  wanted.greatest = options.least + range;
  wanted.greatest_line =
      points.line[static_cast<size_t>(std::ranges::max_element(points.fraction) - points.fraction.begin())];
  return wanted;
}

}  // namespace diastole::shaping
