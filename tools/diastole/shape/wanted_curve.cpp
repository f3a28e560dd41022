#include "tools/diastole/shape/wanted_curve.hpp"

#include <string>

#include "host/config/even_waveform.hpp"
#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::shaping {
namespace {

constexpr std::string_view volume = "volume_mL", pressure = "pressure_kPa";

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
  constexpr size_t room = 2048;
  constexpr Eigen::Index harmonics = 96;
  std::string text = read_bounded_file(options.file, most_table_bytes);
  WantedCurve wanted;
  // The points' reader knows volumes: a pressure has the same rules.
  if (const size_t column = text.find(pressure); column != std::string::npos) {
    wanted.is_pressure = true;
    text.replace(column, pressure.size(), volume);
  }
  const PointsFile points = parse_points(text, options.file.string());
  const double period_s = stated(options, points.cycle_s, options.period_s, "--period-s", "time_s");
  const double range = stated(options, points.range_mL, options.stroke_mL, "--stroke-mL", "volume_mL");
  std::vector<double> values = on_even_phases(points, room).fractions();
  values.pop_back();  // which closes the cycle
  for (double& value : values)
    value = options.least + range * value;
  const auto most = static_cast<Eigen::Index>((values.size() - 1) / 2);
  wanted.curve = periodic_curve(values, period_s, std::min(harmonics, most));
  return wanted;
}

}  // namespace diastole::shaping
