#include "host/cli/bin_output.hpp"

#include <fmt/format.h>

#include <cmath>

namespace diastole {
namespace {

using nlohmann::json;

double variance_of_mean(const runfile::FrameBin& bin, double resolution_kPa) {
  const double spread = bin.cycles > 1 ? bin.sd_kPa * bin.sd_kPa / static_cast<double>(bin.cycles)
                                       : bin.sample_sd_kPa * bin.sample_sd_kPa;
  return spread + resolution_kPa * resolution_kPa / 12;
}

}  // namespace

json bins_as_json(const std::string& run, const runfile::FrameBins& bins, const RemovedDelay& delay) {
  json frames = json::array();
  for (size_t k = 0; k < bins.frames.size(); ++k) {
    const runfile::FrameBin& bin = bins.frames[k];
    frames.push_back({{"frame", k},
                      {"from_s", bin.window.from_s},
                      {"to_s", bin.window.to_s},
                      {"mean_kPa", bin.mean_kPa},
                      {"sd_kPa", bin.sd_kPa},
                      {"sample_sd_kPa", bin.sample_sd_kPa},
                      {"drift_kPa_per_cycle", bin.drift_kPa_per_cycle},
                      {"drift_se_kPa_per_cycle", bin.drift_se_kPa_per_cycle},
                      {"cycles", bin.cycles},
                      {"samples", bin.samples}});
  }
  json excluded = json::array();
  for (const runfile::ExcludedCycle& cycle : bins.excluded)
    excluded.push_back({{"cycle", cycle.cycle}, {"trigger_s", cycle.trigger_s}, {"reason", cycle.reason}});
  return {{"run", run},
          {"segment", bins.segment},
          {"period_s", bins.period_s},
          {"interval_s", bins.interval_s},
          {"delay_removed_s", delay.delay_s},
          {"delay_source", delay.source},
          {"scheduled_cycles", bins.scheduled_cycles},
          {"triggers", bins.triggers},
          {"frames", frames},
          {"excluded", excluded}};
}

void show_bins(const runfile::FrameBins& bins, const RemovedDelay& delay) {
  fmt::print("segment {}, period {:g} s, {} of {} cycles used\n", bins.segment, bins.period_s,
             bins.frames.front().cycles, bins.scheduled_cycles);
  if (delay.delay_s != 0) fmt::print("{:.2f} ms of delay removed ({})\n", 1e3 * delay.delay_s, delay.source);
  fmt::print("frame    from_s      to_s  mean_kPa    sd_kPa  drift_Pa_per_cycle  cycles\n");
  for (size_t k = 0; k < bins.frames.size(); ++k) {
    const runfile::FrameBin& bin = bins.frames[k];
    fmt::print("{:5} {:9.4f} {:9.4f} {:9.4f} {:9.4f} {:19.3f} {:7}\n", k, bin.window.from_s, bin.window.to_s,
               bin.mean_kPa, bin.sd_kPa, 1e3 * bin.drift_kPa_per_cycle, bin.cycles);
  }
}

std::string frames_csv(const runfile::FrameBins& bins, double resolution_kPa, bool relative) {
  const runfile::FrameBin& first = bins.frames.front();
  std::string csv = "frame,time_s,pressure_kPa,sigma_kPa\n";
  for (size_t k = 0; k < bins.frames.size(); ++k) {
    const runfile::FrameBin& bin = bins.frames[k];
    const bool difference = relative && k > 0;
    const double variance =
        variance_of_mean(bin, resolution_kPa) + (difference ? variance_of_mean(first, resolution_kPa) : 0);
    csv += fmt::format("{},{:.6f},{:.6f},{:.6f}\n", k, (bin.window.from_s + bin.window.to_s) / 2,
                       bin.mean_kPa - (relative ? first.mean_kPa : 0), std::sqrt(variance));
  }
  return csv;
}

}  // namespace diastole
