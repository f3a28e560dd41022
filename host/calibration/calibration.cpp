#include "host/calibration/calibration.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr double least_span_V = 1e-3;
constexpr double least_part_of_nominal = 0.1;  // of the span that the rig file's kPa_per_V lets expect

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out.push_back('\\');
    if (static_cast<unsigned char>(c) >= 0x20) out.push_back(c);
  }
  return out + "\"";
}

CalibrationPoint read_point(TableReader table, bool with_kPa) {
  CalibrationPoint point;
  point.volts = table.number("volts");
  if (with_kPa) point.kPa = table.number("kPa");
  point.utc = table.text_or("utc", "");
  point.operator_name = table.text_or("operator", "");
  table.finish();
  return point;
}

std::string in_toml(const CalibrationPoint& point, bool with_kPa) {
  return fmt::format("{{ volts = {:.9}, {}utc = {}, operator = {} }}", point.volts,
                     with_kPa ? fmt::format("kPa = {:.9}, ", point.kPa) : "", quoted(point.utc),
                     quoted(point.operator_name));
}

double slope_of(const ChannelCalibration& found) {
  return (found.points[1].kPa - found.points[0].kPa) / (found.points[1].volts - found.points[0].volts);
}

[[noreturn]] void refuse_line(const CalibrationPoint& first, const CalibrationPoint& second,
                              const std::string& channel) {
  throw InputError(
      {"", channel,
       fmt::format("{:g} kPa read {:.4f} V and {:g} kPa reads {:.4f} V: no line goes through these",
                   first.kPa, first.volts, second.kPa, second.volts),
       "Apply another pressure; if the voltage does not follow, check transducer, cable and the rig "
       "file's kPa_per_V."});
}

ChannelConfig applied(ChannelConfig channel, const ChannelCalibration& found) {
  if (found.points.size() == 2) {
    channel.kPa_per_V = slope_of(found);
    channel.zero_V = found.points[0].volts - found.points[0].kPa / channel.kPa_per_V;
  }
  if (found.zero) channel.zero_V = found.zero->volts;
  return channel;
}

void write_whole(const std::filesystem::path& path, const std::string& text) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  const bool written = file.valid() &&
                       ::write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       ::fsync(file.get()) == 0;
  if (!written) {
    throw HardwareError(path.string(), "cannot be written",
                        "The daemon must be able to write beside its rig file; check owner and disk.");
  }
}

}  // namespace

void ChannelCalibration::add(const CalibrationPoint& point, const std::string& channel) {
  if (points.size() == 2) points.clear();
  if (points.size() == 1) {
    const double span_V = std::abs(point.volts - points[0].volts);
    if (point.kPa == points[0].kPa || span_V < least_span_V) refuse_line(points[0], point, channel);
    zero.reset();
  }
  points.push_back(point);
}

CalibrationBook::CalibrationBook(const std::filesystem::path& rig_file, std::vector<ChannelConfig> nominal)
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

std::vector<ChannelConfig> CalibrationBook::channels() const {
  std::vector<ChannelConfig> channels = nominal_;
  for (ChannelConfig& channel : channels) {
    if (const auto found = found_.find(channel.name); found != found_.end()) {
      channel = applied(channel, found->second);
    }
  }
  return channels;
}

Attributes CalibrationBook::attributes() const {
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

ChannelCalibration& CalibrationBook::need(const std::string& channel) {
  if (std::none_of(nominal_.begin(), nominal_.end(),
                   [&](const ChannelConfig& each) { return each.name == channel; })) {
    std::vector<std::string> names;
    for (const ChannelConfig& each : nominal_)
      names.push_back(each.name);
    throw InputError({"", channel, "is no channel of this rig",
                      "Its channels are: " + fmt::format("{}", fmt::join(names, ", ")) + "."});
  }
  return found_[channel];
}

const ChannelCalibration& CalibrationBook::of(const std::string& channel) { return need(channel); }

void CalibrationBook::add_point(const std::string& channel, const CalibrationPoint& point) {
  ChannelCalibration& found = need(channel);
  const auto nominal = std::find_if(nominal_.begin(), nominal_.end(),
                                    [&](const ChannelConfig& each) { return each.name == channel; });
  if (found.points.size() == 1) {
    const CalibrationPoint& first = found.points[0];
    const double expected_V = std::abs((point.kPa - first.kPa) / nominal->kPa_per_V);
    if (std::abs(point.volts - first.volts) < least_part_of_nominal * expected_V)
      refuse_line(first, point, channel);
  }
  found.add(point, channel);
}

void CalibrationBook::set_zero(const std::string& channel, const CalibrationPoint& zero) {
  need(channel).zero = zero;
}

void CalibrationBook::save() const {
  if (file_.empty()) return;
  std::string text =
      "# Written by `diastole calibrate` and `diastole zero`; goes before kPa_per_V and zero_V of the rig "
      "file.\n"
      "format = \"diastole-calibration\"\nversion = 1\n";
  for (const auto& [name, found] : found_) {
    if (found.points.empty() && !found.zero) continue;
    text += fmt::format("\n[channel.{}]\n", quoted(name));
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

}  // namespace diastole
