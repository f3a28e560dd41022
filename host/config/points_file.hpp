#pragma once
// The points of an uploaded waveform, as a person writes them: comma-separated, `#` begins a comment, the first
// line names the two columns.
//
//   phase,fraction        0 … 1 of the cycle, 0 … 1 of the stroke
//   time_s,volume_mL      or either of these: the cycle is as long as the last time, the stroke as large as the range
//   0,0
//   …
//   1,0                   the last point closes the cycle: it is the first one of the next
//
// The first point lies at 0 and is the least volume, so that a cycle begins at rest; phases increase strictly;
// the last volume is the first one, to 1/10000 of the range. A fraction reaches 1.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace diastole {

struct PointsFile {
  std::string file;                 ///< for messages
  std::string text;                 ///< as it was read
  std::vector<double> phase;        ///< from 0 to 1
  std::vector<double> fraction;     ///< of the stroke, from 0 to 1 and back to 0
  std::vector<size_t> line;         ///< of the file, in which each point stands
  std::optional<double> cycle_s;    ///< if the file states times
  std::optional<double> range_mL;   ///< if the file states volumes
  std::optional<double> range_kPa;  ///< if it states pressures
};

/// What the second column may state beside fractions.
enum class PointsOf { volume, volume_or_pressure };

/// Throws InputError with file, line and what to change.
PointsFile parse_points(std::string_view text, const std::string& file, PointsOf of = PointsOf::volume);

}  // namespace diastole
