#include "host/runfile/bids_export.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>

#include "protocol/runfile/layout.hpp"

namespace diastole {
namespace {

using nlohmann::ordered_json;

std::string describe(const std::string& channel) {
  if (channel == runfile::cavity_channel)
    return "Pressure in the cavity, catheter transducer, not low-passed";
  if (channel == runfile::cavity_filtered_channel) return "Pressure in the cavity, low-passed without lag";
  if (channel == "pump_kPa") return "Pressure at the pump end of the hose";
  return "Pressure, channel " + channel;
}

/// Commanded volume at a time, NaN outside the trace or beside a missing position.
double volume_at(const runfile::PumpTrace& pump, double time_s) {
  const auto after = std::ranges::lower_bound(pump.time_s, time_s);
  const auto row = static_cast<size_t>(after - pump.time_s.begin());
  if (after == pump.time_s.end() || (row == 0 && *after != time_s))
    return std::numeric_limits<double>::quiet_NaN();
  if (*after == time_s) return pump.commanded_mL[row];
  const double part = (time_s - pump.time_s[row - 1]) / (*after - pump.time_s[row - 1]);
  return std::lerp(pump.commanded_mL[row - 1], pump.commanded_mL[row], part);
}

std::vector<int> trigger_column(const std::vector<double>& trigger_s, std::span<const double> time_s) {
  std::vector<int> column(time_s.size(), 0);
  for (const double t : trigger_s) {
    auto row = static_cast<size_t>(std::ranges::lower_bound(time_s, t) - time_s.begin());
    if (row == time_s.size() || (row > 0 && t - time_s[row - 1] < time_s[row] - t)) --row;
    column[row] = 1;
  }
  return column;
}

std::string cell(double value) { return std::isnan(value) ? "n/a" : fmt::format("{:.6g}", value); }

}  // namespace

BidsRecording bids_recording(const runfile::RecordedRun& run) {
  const std::vector<double>& time_s = run.pressure.time_s;
  const double rate_Hz = static_cast<double>(time_s.size() - 1) / (time_s.back() - time_s.front());
  const double zero_s = run.trigger_s.empty() ? 0 : run.trigger_s.front();
  ordered_json columns = ordered_json::array();
  BidsRecording recording;
  recording.description = {{"SamplingFrequency", rate_Hz}, {"StartTime", time_s.front() - zero_s}};
  for (const auto& [name, values] : run.pressure.channels)
    columns.push_back(name);
  columns.push_back("commanded_mL");
  columns.push_back("trigger");
  recording.description["Columns"] = columns;
  for (const auto& [name, values] : run.pressure.channels)
    recording.description[name] = {{"Description", describe(name)}, {"Units", "kPa"}};
  recording.description["commanded_mL"] = {{"Description", "Volume of the steps that the pump was commanded"},
                                           {"Units", "mL"}};
  recording.description["trigger"] = {
      {"Description", "1 in the sample nearest to the start of a cycle, which triggers the scanner; else 0"},
      {"Units", "1"}};
  recording.description["RunID"] = run.run_id;
  recording.description["AcquisitionDateTime"] = run.started_utc;
  recording.description["SoftwareName"] = run.producer;

  const std::vector<int> triggers = trigger_column(run.trigger_s, time_s);
  for (size_t i = 0; i < time_s.size(); ++i) {
    for (const auto& [name, values] : run.pressure.channels)
      recording.table += cell(values[i]) + '\t';
    recording.table += fmt::format("{}\t{}\n", cell(volume_at(run.pump, time_s[i])), triggers[i]);
  }
  return recording;
}

std::string gzip(const std::string& content) {
  constexpr int gzip_window_bits = 15 + 16;
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, gzip_window_bits, 8, Z_DEFAULT_STRATEGY) !=
      Z_OK) {
    throw std::runtime_error("zlib cannot be started");
  }
  std::string packed(deflateBound(&stream, content.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int result = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::runtime_error("zlib cannot pack the table");
  return packed;
}

}  // namespace diastole
