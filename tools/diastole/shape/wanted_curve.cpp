#include "tools/diastole/shape/wanted_curve.hpp"

#include <algorithm>
#include <string>
#include <string_view>

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

/// Where the names of the columns say pressure_kPa: in the first line that holds more than a comment.
size_t pressure_column(std::string_view text) {
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    const std::string_view content = line.substr(0, line.find('#'));
    if (content.find_first_not_of(" \t\r") != std::string_view::npos) {
      const size_t column = content.find(pressure);
      return column == std::string_view::npos ? column : begin + column;
    }
    begin = end + 1;
  }
  return std::string_view::npos;
}

std::string with_pressure(std::string words) {
  for (size_t at = 0; (at = words.find(volume, at)) != std::string::npos; at += pressure.size())
    words.replace(at, volume.size(), pressure);
  return words;
}

/// The points' reader knows volumes: a pressure has the same rules.
PointsFile read_points(const std::filesystem::path& file, bool& is_pressure) {
  std::string text = read_bounded_file(file, most_table_bytes);
  const size_t column = pressure_column(text);
  is_pressure = column != std::string::npos;
  if (!is_pressure) return parse_points(text, file.string());
  text.replace(column, pressure.size(), volume);
  try {
    return parse_points(text, file.string());
  } catch (const InputError& error) {
    const InputFault& fault = error.fault();
    throw InputError({fault.file, fault.place, with_pressure(fault.problem), with_pressure(fault.remedy)});
  }
}

}  // namespace

WantedCurve read_wanted_curve(const WantedOptions& options) {
  constexpr size_t room = 2048;
  constexpr Eigen::Index harmonics = 96;
  WantedCurve wanted;
  const PointsFile points = read_points(options.file, wanted.is_pressure);
  const double period_s = stated(options, points.cycle_s, options.period_s, "--period-s", "time_s");
  const double range =
      stated(options, points.range_mL, options.stroke_mL, "--stroke-mL", "volume_mL or pressure_kPa");
  std::vector<double> values = on_even_phases(points, room).fractions();
  values.pop_back();  // which closes the cycle
  for (double& value : values)
    value = options.least + range * value;
  const auto most = static_cast<Eigen::Index>((values.size() - 1) / 2);
  wanted.curve = periodic_curve(values, period_s, std::min(harmonics, most));
  return wanted;
}

}  // namespace diastole::shaping
