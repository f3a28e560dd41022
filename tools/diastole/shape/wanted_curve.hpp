#pragma once
// TARGET.csv: the curve that the specimen is to follow, in the format of an uploaded waveform's points (host/config/points_file.hpp), whose
// second column may be pressure_kPa too. Between points runs the controller's curve.

#include <filesystem>
#include <optional>

#include "estimator/shaping/periodic_curve.hpp"

namespace diastole::shaping {

struct WantedOptions {
  std::filesystem::path file;
  std::optional<double> period_s = {};   ///< of phases alone: seconds state it themselves
  std::optional<double> stroke_mL = {};  ///< of fractions alone
  double least = 0.0;  ///< what the first, lowest point stands for: mL taken since rest, or kPa
};

struct WantedCurve {
  PeriodicCurve curve;  ///< mL taken by the specimen since rest, or kPa
  bool is_pressure = false;
  double greatest = 0.0;     ///< of its points
  size_t greatest_line = 0;  ///< of the file, in which it stands
};

/// Throws InputError with file, line and remedy.
WantedCurve read_wanted_curve(const WantedOptions& options);

}  // namespace diastole::shaping
