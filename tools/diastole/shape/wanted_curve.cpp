#include "tools/diastole/shape/wanted_curve.hpp"

#include <fmt/format.h>

#include <string>

#include "host/config/even_waveform.hpp"
#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::shaping {
namespace {

double stated(const WantedOptions& options, const std::optional<double>& in_file,
              const std::optional<double>& given, const char* option, const char* column) {
  const double value = given ? *given : in_file.value_or(0.0);
  if (value > 0.0) return value;
  throw InputError({options.file.string(), std::string("option ") + option,
                    std::string("is missing, and the file has no ") + column,
                    std::string("Give ") + option + ", or points with that column."});
}

}  // namespace

WantedCurve read_wanted_curve(const WantedOptions& options) {
  constexpr Eigen::Index harmonics = 96;
  constexpr size_t phases = 2048;
  WantedCurve wanted;
  const PointsFile points = parse_points(read_bounded_file(options.file, most_table_bytes),
                                         options.file.string(), PointsOf::volume_or_pressure);
  wanted.is_pressure = points.range_kPa.has_value();
  const double period_s = stated(options, points.cycle_s, options.period_s, "--period-s", "time_s");
  constexpr double longest_period_s = 600.0;  // the controller's
  if (period_s > longest_period_s) {
    throw InputError(
        {options.file.string(), points.cycle_s ? "column time_s" : "option --period-s",
         fmt::format("is a cycle of {:g} s, and the pump's longest is {:g} s", period_s, longest_period_s),
         "Give times in seconds."});
  }
  const double range = stated(options, wanted.is_pressure ? points.range_kPa : points.range_mL,
                              options.stroke_mL, "--stroke-mL", "volume_mL or pressure_kPa");
  std::vector<double> values = curve_at_even_phases(points, phases);
  for (double& value : values)
    value = options.least + range * value;
  wanted.curve = periodic_curve(values, period_s, harmonics);
  return wanted;
}

}  // namespace diastole::shaping
