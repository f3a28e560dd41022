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

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/config/rig_config.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

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
};

class CalibrationBook {
 public:
  /// For the channels of a rig file as it gives them. Reads the file beside it if there is one; throws InputError with
  /// file, line and key. An empty name: nothing is read, and save() keeps nothing.
  CalibrationBook(const std::filesystem::path& rig_file, std::vector<ChannelConfig> nominal)
      : file_(rig_file), nominal_(std::move(nominal)) {
    if (file_.empty()) return;
    file_.replace_extension(".calibration.toml");
    if (!std::filesystem::exists(file_)) return;
    TableReader root = TableReader::from_file(file_);
    root.expect_format("diastole-calibration", 1);
    auto all = root.table_if("channel");
    if (all) {
      for (auto& [name, table] : all->named_tables()) {
        ChannelCalibration& found = found_[name];
        for (TableReader& point : table.tables("points"))
          found.points.push_back(read_point(std::move(point), true));
        if (auto zero = table.table_if("zero")) found.zero = read_point(std::move(*zero), false);
        table.finish();
        if (found.points.size() > 2) table.fail("points", "has more than two", "Calibrate again.");
        if (found.points.size() == 2 &&
            std::abs(found.points[1].volts - found.points[0].volts) < least_span_V) {
          table.fail("points", "lie too close together for a line", "Calibrate again.");
        }
      }
    }
    root.finish();
  }

  /// The channels as they are to be used.
  [[nodiscard]] std::vector<ChannelConfig> channels() const {
    std::vector<ChannelConfig> channels = nominal_;
    for (ChannelConfig& channel : channels) {
      if (const auto found = found_.find(channel.name); found != found_.end()) {
        channel = applied(channel, found->second);
      }
    }
    return channels;
  }
  /// Of /rig in the run file: cavity_kPa_per_V, cavity_zero_V, and where they are known cavity_calibrated_utc,
  /// cavity_calibrated_by, cavity_zeroed_utc, cavity_zeroed_by.
  [[nodiscard]] Attributes attributes() const {
    Attributes out;
    for (const ChannelConfig& channel : channels()) {
      out[channel.name + "_kPa_per_V"] = channel.kPa_per_V;
      out[channel.name + "_zero_V"] = channel.zero_V;
      const auto found = found_.find(channel.name);
      if (found == found_.end()) continue;
      if (found->second.points.size() == 2) {
        out[channel.name + "_calibrated_utc"] = found->second.points[1].utc;
        out[channel.name + "_calibrated_by"] = found->second.points[1].operator_name;
      }
      if (found->second.zero) {
        out[channel.name + "_zeroed_utc"] = found->second.zero->utc;
        out[channel.name + "_zeroed_by"] = found->second.zero->operator_name;
      }
    }
    return out;
  }

  /// Throw InputError for a channel that there is not, or a point that cannot be used (one that makes no line with the one
  /// before); then nothing is changed.
  void add_point(const std::string& channel, const CalibrationPoint& point) {
    ChannelCalibration& found = need(channel);
    if (found.points.size() == 2) found.points.clear();
    if (found.points.size() == 1) {
      const CalibrationPoint& first = found.points[0];
      const auto nominal = std::ranges::find(nominal_, channel, &ChannelConfig::name);
      const double expected_V = std::abs((point.kPa - first.kPa) / nominal->kPa_per_V);
      const double span_V = std::abs(point.volts - first.volts);
      if (point.kPa == first.kPa || span_V < std::max(least_span_V, least_part_of_nominal * expected_V))
        refuse_line(first, point, channel);
      found.zero.reset();
    }
    found.points.push_back(point);
  }
  void set_zero(const std::string& channel, const CalibrationPoint& zero) { need(channel).zero = zero; }
  /// Replaces the file at once as a whole. Throws HardwareError; then the old one stands.
  void save() const {
    if (file_.empty()) return;
    std::string text =
        "# Written by `diastole calibrate` and `diastole zero`; goes before kPa_per_V and zero_V of the rig "
        "file.\n"
        "format = \"diastole-calibration\"\nversion = 1\n";
    for (const auto& [name, found] : found_) {
      if (found.points.empty() && !found.zero) continue;
      text += fmt::format("\n[channel.{}]\n", toml_text(name));
      if (!found.points.empty()) {
        text += "points = [\n";
        for (const CalibrationPoint& point : found.points)
          text += "  " + in_toml(point, true) + ",\n";
        text += "]\n";
      }
      if (found.zero) text += "zero = " + in_toml(*found.zero, false) + "\n";
    }
    const std::filesystem::path temporary = fmt::format("{}.{}.part", file_.string(), ::getpid());
    write_whole(temporary, text);
    std::error_code error;
    std::filesystem::rename(temporary, file_, error);
    if (error) throw HardwareError(file_.string(), error.message(), "Check that the daemon may write there.");
    const auto parent = file_.has_parent_path() ? file_.parent_path() : std::filesystem::path(".");
    const Descriptor directory(::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (directory.valid()) ::fsync(directory.get());
  }

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const ChannelCalibration& of(const std::string& channel) { return need(channel); }

 private:
  static constexpr double least_span_V = 1e-3;
  static constexpr double least_part_of_nominal =
      0.1;  // of the span that the rig file's kPa_per_V lets expect

  static CalibrationPoint read_point(TableReader table, bool with_kPa) {
    CalibrationPoint point;
    point.volts = table.number("volts");
    if (with_kPa) point.kPa = table.number("kPa");
    point.utc = table.text_or("utc", "");
    point.operator_name = table.text_or("operator", "");
    table.finish();
    return point;
  }

  static std::string in_toml(const CalibrationPoint& point, bool with_kPa) {
    return fmt::format("{{ volts = {:.9}, {}utc = {}, operator = {} }}", point.volts,
                       with_kPa ? fmt::format("kPa = {:.9}, ", point.kPa) : "", toml_text(point.utc),
                       toml_text(point.operator_name));
  }

  static double slope_of(const ChannelCalibration& found) {
    return (found.points[1].kPa - found.points[0].kPa) / (found.points[1].volts - found.points[0].volts);
  }

  [[noreturn]] static void refuse_line(const CalibrationPoint& first, const CalibrationPoint& second,
                                       const std::string& channel) {
    throw InputError(
        {"", channel,
         fmt::format("{:g} kPa read {:.4f} V and {:g} kPa reads {:.4f} V: no line goes through these",
                     first.kPa, first.volts, second.kPa, second.volts),
         "Apply another pressure; if the voltage does not follow, check transducer, cable and the rig "
         "file's kPa_per_V."});
  }

  static ChannelConfig applied(ChannelConfig channel, const ChannelCalibration& found) {
    if (found.points.size() == 2) {
      channel.kPa_per_V = slope_of(found);
      channel.zero_V = found.points[0].volts - found.points[0].kPa / channel.kPa_per_V;
    }
    if (found.zero) channel.zero_V = found.zero->volts;
    return channel;
  }

  static void write_whole(const std::filesystem::path& path, const std::string& text) {
    const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    const bool written = file.valid() &&
                         ::write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                         ::fsync(file.get()) == 0;
    if (!written) {
      throw HardwareError(path.string(), "cannot be written",
                          "The daemon must be able to write beside its rig file; check owner and disk.");
    }
  }

  ChannelCalibration& need(const std::string& channel) {
    if (std::ranges::find(nominal_, channel, &ChannelConfig::name) == nominal_.end()) {
      std::vector<std::string> names;
      for (const ChannelConfig& each : nominal_)
        names.push_back(each.name);
      throw InputError({"", channel, "is no channel of this rig",
                        "Its channels are: " + fmt::format("{}", fmt::join(names, ", ")) + "."});
    }
    return found_[channel];
  }

  std::filesystem::path file_;
  std::vector<ChannelConfig> nominal_;
  std::map<std::string, ChannelCalibration> found_;
};

}  // namespace diastole
