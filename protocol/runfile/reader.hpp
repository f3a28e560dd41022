#pragma once
// Reads and checks a run file.

#include <filesystem>
#include <string>
#include <utility>

#include "protocol/runfile/run.hpp"
#include "protocol/runfile/stream_rows.hpp"

namespace diastole::runfile {

class H5Source;

/// Reads a whole run. Throws InputError that names the dataset and the first offending index when the file is
/// missing, not a run file, of a newer format_version, or breaks a rule of `check`.
RecordedRun read_run(const std::filesystem::path& path);

/// A run whose rows stay in its file, however many they are.
struct RunFile {
  RecordedRun
      run;  ///< without rows: run.pump and run.pressure hold what is known of them, and the channels' names
  RunRows rows;
};

/// Throws as read_run; goes through all rows once.
RunFile open_run(const std::filesystem::path& path);
/// The same of a file that is open (h5_source.hpp).
RunFile open_run(const H5Source& source);

/// Far beyond any run, and within what arithmetic on times and counts bears without another check.
inline constexpr double longest_time_s = 1e10;
inline constexpr double shortest_period_s = 1e-6;
inline constexpr int64_t most_counted = 1'000'000'000'000;

/// The rules that every run obeys: times within longest_time_s and strictly increasing, datasets of a stream equally
/// long, no NaN outside a declared gap, no infinity, segments in order with a period of shortest_period_s or more,
/// slices in order within the triggers, no negative counts and none beyond most_counted.
/// Throws InputError with run.file as the file.
void check(const RecordedRun& run);
/// The same of a run without rows, and these.
void check(const RecordedRun& run, const RunRows& rows);

/// The rules of `check` for a stream that is not in memory as a whole, row by row; the row must have a value. Throws as
/// `check` does.
class StreamCheck {
 public:
  /// `group`: "/pressure", whose time is "/pressure/time_s".
  StreamCheck(std::string file, std::string group) : file_(std::move(file)), group_(std::move(group)) {}
  void time(double time_s);
  /// Of the row whose time was given last.
  void value(const std::string& dataset, double value) const;

 private:
  std::string file_;
  std::string group_;
  size_t rows_ = 0;
  double last_s_ = 0;
};

}  // namespace diastole::runfile
