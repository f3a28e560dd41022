#pragma once
// What turns a channel's volts into kPa, and who found it out when. The rig file gives nominal values; a calibration
// file beside it (rig.toml -> rig.calibration.toml), written by `diastole calibrate` and `diastole zero`, goes before:
//
//   format = "diastole-calibration"
//   version = 1
//   [channel.cavity]
//   points = [                        # one or two: what the channel read at a known pressure, at rest
//     { volts = 0.0123, kPa = 0.0, utc = "2026-11-21T09:00:00Z", operator = "A. Nguyen" },
//     { volts = 2.5010, kPa = 10.0, utc = "2026-11-21T09:04:00Z", operator = "A. Nguyen" },
//   ]
//   zero = { volts = 0.0119, utc = "2026-11-21T10:30:00Z", operator = "A. Nguyen" }
//
//   pressure = (volts - zero_V) kPa_per_V
//   two points:  kPa_per_V = (kPa2 - kPa1) / (volts2 - volts1),  zero_V = volts1 - kPa1 / kPa_per_V
//   a zero:      zero_V = volts, from then on; a new second point forgets it
//
// With one point only, the rig file's values hold. A first point after two begins anew.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/config/rig_config.hpp"

namespace diastole {

struct CalibrationPoint {
  double volts = 0;
  double kPa = 0;
  std::string utc;
  std::string operator_name;
};

struct ChannelCalibration {
  std::vector<CalibrationPoint> points;  ///< two at most
  std::optional<CalibrationPoint> zero;  ///< kPa 0

  /// Adds a point; throws InputError if it cannot make a line with the one before.
  void add(const CalibrationPoint& point, const std::string& channel);
};

class CalibrationBook {
 public:
  /// For the channels of a rig file as it gives them. Reads the file beside it if there is one; throws InputError with
  /// file, line and key. An empty name: nothing is read, and save() keeps nothing.
  CalibrationBook(const std::filesystem::path& rig_file, std::vector<ChannelConfig> nominal);

  /// The channels as they are to be used.
  [[nodiscard]] std::vector<ChannelConfig> channels() const;
  /// Of /rig in the run file: cavity_kPa_per_V, cavity_zero_V, and where they are known cavity_calibrated_utc,
  /// cavity_calibrated_by, cavity_zeroed_utc, cavity_zeroed_by.
  [[nodiscard]] Attributes attributes() const;

  /// Throw InputError for a channel that there is not, or a point that cannot be used; then nothing is changed.
  void add_point(const std::string& channel, const CalibrationPoint& point);
  void set_zero(const std::string& channel, const CalibrationPoint& zero);
  /// Replaces the file at once as a whole. Throws HardwareError; then the old one stands.
  void save() const;

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const ChannelCalibration& of(const std::string& channel);

 private:
  ChannelCalibration& need(const std::string& channel);

  std::filesystem::path file_;
  std::vector<ChannelConfig> nominal_;
  std::map<std::string, ChannelCalibration> found_;
};

}  // namespace diastole
