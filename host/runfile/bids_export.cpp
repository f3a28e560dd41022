#include "host/runfile/bids_export.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "host/journal/part_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/commanded_volume.hpp"
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

/// The row nearest to each trigger, ascending.
std::vector<size_t> trigger_rows(const std::vector<double>& trigger_s, const runfile::Series& time_s) {
  std::vector<size_t> nearest;
  double before_s = -std::numeric_limits<double>::infinity();
  time_s.each_block([&](size_t first, std::span<const double> block) {
    for (size_t i = 0; i < block.size(); ++i) {
      const double here_s = std::exchange(before_s, block[i]);
      for (; nearest.size() < trigger_s.size() && trigger_s[nearest.size()] <= block[i];) {
        const double t = trigger_s[nearest.size()];
        nearest.push_back(t - here_s < block[i] - t ? first + i - 1 : first + i);
      }
    }
  });
  nearest.resize(trigger_s.size(), time_s.size() - 1);
  return nearest;
}

std::string cell(double value) { return std::isnan(value) ? "n/a" : fmt::format("{:.6g}", value); }

}  // namespace

nlohmann::ordered_json bids_description(const runfile::RunFile& file) {
  const auto& [run, rows] = file;
  const runfile::Spacing& spacing = rows.pressure.spacing();
  const double rate_Hz =
      static_cast<double>(rows.pressure.time_s.size() - 1) / (spacing.last_s - spacing.first_s);
  const double zero_s = run.trigger_s.empty() ? 0 : run.trigger_s.front();
  ordered_json columns = ordered_json::array();
  ordered_json description{{"SamplingFrequency", rate_Hz}, {"StartTime", spacing.first_s - zero_s}};
  for (const auto& [name, values] : rows.pressure.values)
    columns.push_back(name);
  columns.push_back("commanded_mL");
  columns.push_back("trigger");
  description["Columns"] = columns;
  for (const auto& [name, values] : rows.pressure.values)
    description[name] = {{"Description", describe(name)}, {"Units", "kPa"}};
  description["commanded_mL"] = {{"Description", "Volume of the steps that the pump was commanded"},
                                 {"Units", "mL"}};
  description["trigger"] = {
      {"Description", "1 in the sample nearest to the start of a cycle, which triggers the scanner; else 0"},
      {"Units", "1"}};
  description["RunID"] = run.run_id;
  description["AcquisitionDateTime"] = run.started_utc;
  description["SoftwareName"] = run.producer;
  return description;
}

void bids_table(const runfile::RunFile& file, const std::function<void(std::string_view)>& take) {
  const runfile::StreamRows& pressure = file.rows.pressure;
  const std::vector<size_t> triggers = trigger_rows(file.run.trigger_s, pressure.time_s);
  auto trigger = triggers.begin();
  runfile::CommandedVolume volume(file.rows.pump);
  std::vector<std::vector<double>> memory(pressure.values.size());
  std::string text;
  pressure.time_s.each_block([&](size_t first, std::span<const double> time_s) {
    std::vector<std::span<const double>> channels;
    for (const auto& [name, values] : pressure.values)
      channels.push_back(values.rows(first, time_s.size(), memory[channels.size()]));
    text.clear();
    for (size_t i = 0; i < time_s.size(); ++i) {
      for (const auto& channel : channels)
        text += cell(channel[i]) + '\t';
      const bool is_trigger = trigger != triggers.end() && *trigger == first + i;
      while (trigger != triggers.end() && *trigger == first + i)
        ++trigger;
      text += fmt::format("{}\t{:d}\n", cell(volume.at(time_s[i])), is_trigger);
    }
    take(text);
  });
}

void write_bids_table(const runfile::RunFile& file, const std::filesystem::path& table) try {
  const auto must = [](bool done) {
    if (!done) throw std::filesystem::filesystem_error("cannot be written", std::error_code());
  };
  write_whole(table, [&](const std::filesystem::path& part) {
    const std::unique_ptr<gzFile_s, int (*)(gzFile)> opened(gzopen(part.c_str(), "wb"), gzclose);
    must(opened != nullptr);
    bids_table(file, [&](std::string_view text) {
      must(gzwrite(opened.get(), text.data(), static_cast<unsigned>(text.size())) > 0);
    });
    must(gzflush(opened.get(), Z_FINISH) == Z_OK);
  });
} catch (const std::filesystem::filesystem_error&) {
  throw HardwareError(table.string(), "cannot be written", "Check the disk's space and your rights there.");
}

}  // namespace diastole
