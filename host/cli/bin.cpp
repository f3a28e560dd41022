#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/host_commands.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
namespace {

using nlohmann::json;

struct BinOptions {
  std::string run;
  size_t frames = 16;
  std::optional<size_t> segment;
  std::string channel = "cavity_kPa";
  std::vector<std::string> windows;
};

runfile::FrameWindow parse_window(const std::string& text) {
  runfile::FrameWindow window;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf:%lf%c", &window.from_s, &window.to_s, &rest) != 2) {
    throw InputError(
        {"", "--window " + text, "is not FROM:TO", "For example --window 0.10:0.15, in seconds."});
  }
  return window;
}

json as_json(const std::string& run, const runfile::FrameBins& bins) {
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
                      {"cycles", bin.cycles},
                      {"samples", bin.samples}});
  }
  json excluded = json::array();
  for (const runfile::ExcludedCycle& cycle : bins.excluded)
    excluded.push_back({{"cycle", cycle.cycle}, {"trigger_s", cycle.trigger_s}, {"reason", cycle.reason}});
  return {{"run", run},
          {"segment", bins.segment},
          {"period_s", bins.period_s},
          {"scheduled_cycles", bins.scheduled_cycles},
          {"triggers", bins.triggers},
          {"frames", frames},
          {"excluded", excluded}};
}

void show(const runfile::FrameBins& bins) {
  fmt::print("segment {}, period {:g} s, {} of {} cycles used\n", bins.segment, bins.period_s,
             bins.frames.front().cycles, bins.scheduled_cycles);
  fmt::print("frame    from_s      to_s  mean_kPa    sd_kPa  cycles\n");
  for (size_t k = 0; k < bins.frames.size(); ++k) {
    const runfile::FrameBin& bin = bins.frames[k];
    fmt::print("{:5} {:9.4f} {:9.4f} {:9.4f} {:9.4f} {:7}\n", k, bin.window.from_s, bin.window.to_s,
               bin.mean_kPa, bin.sd_kPa, bin.cycles);
  }
}

ExitCode bin(const BinOptions& options, const CommandOutput& out) {
  runfile::FrameBinOptions how{
      .frames = options.frames, .windows = {}, .segment = options.segment, .channel = options.channel};
  for (const std::string& window : options.windows)
    how.windows.push_back(parse_window(window));
  const runfile::FrameBins bins = runfile::bin_frames(runfile::read_run(options.run), how);
  for (const runfile::ExcludedCycle& cycle : bins.excluded)
    fmt::print(stderr, "cycle {} at {:.3f} s is left out: {}\n", cycle.cycle, cycle.trigger_s, cycle.reason);
  if (out.json) {
    std::cout << as_json(options.run, bins).dump(2) << '\n';
  } else {
    show(bins);
  }
  return ExitCode::done;
}

}  // namespace

void add_bin(CommandLine& line) {
  auto options = std::make_shared<BinOptions>();
  CLI::App* command =
      line.add("bin", "pressure averaged into the image frames of a cycle",
               "  diastole bin gel.run.h5 --frames 16\n"
               "      16 equal frames from each trigger on; sd_kPa is over the cycles\n"
               "  diastole bin gel.run.h5 --segment 2 --json\n"
               "  diastole bin gel.run.h5 --window 0.00:0.06 --window 0.10:0.16\n"
               "      the windows in which the scanner really took its lines, in seconds from the trigger");
  command->add_option("RUN", options->run, "run file")->required();
  command->add_option("--frames", options->frames, "equal frames in a cycle")->check(CLI::Range(1, 10000));
  command->add_option("--segment", options->segment,
                      "segment number, from 0; default: the first with triggers");
  command->add_option("--channel", options->channel, "pressure channel");
  command->add_option("--window", options->windows, "FROM:TO of one frame, instead of equal frames");
  line.on_run(command, [options](const CommandOutput& out) { return bin(*options, out); });
}

}  // namespace diastole
