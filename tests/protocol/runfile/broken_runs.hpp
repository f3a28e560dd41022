#pragma once
// A sound run file that a test writes with HDF5's own interface, and then damages in one place.

#include <filesystem>
#include <string>
#include <vector>

namespace diastole::runfile {

struct GapRow {
  std::string stream;
  long long first_index;
  long long count;
};

struct RunSketch {
  std::string format = "diastole-run";
  long long format_version = 1;
  std::vector<double> pump_time_s{0, 1, 2, 3};
  std::vector<double> commanded_mL{0, 10, 10, 0};
  std::vector<double> pressure_time_s{0, 1, 2, 3};
  std::vector<double> cavity_kPa{0.1, 1.1, 1.2, 0.1};
  std::string cavity_units = "kPa";
  std::vector<double> trigger_s{0.5};
  std::vector<GapRow> gaps{};
  bool variable_length_texts = true;
  std::string leave_out{};  ///< a dataset's path
};

/// Writes the sketch; overwrites.
void write_sketch(const std::filesystem::path& path, const RunSketch& sketch);

/// A file name in a directory of this test run, which is gone when it ends.
std::filesystem::path scratch_file(const std::string& name);

}  // namespace diastole::runfile
