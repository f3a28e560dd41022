#pragma once
// A recorded run's pressure at the instrument's inputs, in place of the plant's.
//
// The k-th sample after the start of run is answered with the k-th of the recording, volts = zero_V + kPa / kPa_per_V,
// and fails where the recording has a gap. So rows keep their partners whatever lies between the start of run and the
// first sample; that start phase differs from the recording's by less than a sample. Before the run the inputs show
// the first sample, behind the recording's end the last.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tools/sim_rig/rig_description.hpp"

namespace diastole::sim_rig {

class Playback {
 public:
  /// Throws InputError when the file is no run file, or lacks one of the channels that have inputs.
  Playback(const std::filesystem::path& run_file, const std::vector<DaqChannel>& channels) {
    const runfile::RecordedRun run = runfile::read_run(run_file);
    const std::vector<double>& time_s = run.pressure.time_s;
    if (time_s.size() < 2) {
      throw InputError({run_file.string(), "/pressure", "holds no samples to play", "Name another run."});
    }
    rate_Hz_ = static_cast<double>(time_s.size() - 1) / (time_s.back() - time_s.front());
    missing_.assign(time_s.size(), false);
    for (const DaqChannel& channel : channels) {
      const auto recorded = run.pressure.channels.find(channel.name + "_kPa");
      if (recorded == run.pressure.channels.end()) {
        throw InputError({run_file.string(), fmt::format("/pressure/{}_kPa", channel.name), "is missing",
                          "Leave that [[daq.channel]] out of the rig file."});
      }
      Input& input = inputs_.emplace_back(Input{channel.input, {}});
      double last_kPa = 0;
      for (size_t row = 0; row < time_s.size(); ++row) {
        const double recorded_kPa = recorded->second[row];
        missing_[row] = missing_[row] || std::isnan(recorded_kPa);
        if (!std::isnan(recorded_kPa)) last_kPa = recorded_kPa;
        input.volts.push_back(channel.zero_V + last_kPa / channel.kPa_per_V);
      }
    }
  }

  /// The instrument samples now; run_start_ns: RunClock.
  void sample(uint64_t now_ns, std::optional<uint64_t> run_start_ns) {
    row_ = 0;
    if (!run_start_ns || now_ns < *run_start_ns) return;
    // A start that is announced, and confirmed a few ns off, is one and the same.
    const bool another_run = !run_start_ns_ || *run_start_ns > *run_start_ns_ + 1'000'000;
    if (another_run) first_ns_ = now_ns;
    run_start_ns_ = run_start_ns;
    const auto index = std::llround(static_cast<double>(now_ns - *first_ns_) * 1e-9 * rate_Hz_);
    row_ = std::min(static_cast<size_t>(index), missing_.size() - 1);
  }
  /// Whether the recording misses this sample.
  [[nodiscard]] bool missing() const { return missing_[row_]; }
  [[nodiscard]] double volts(int64_t input) const {
    const auto found = std::ranges::find(inputs_, input, &Input::input);
    return found == inputs_.end() ? 0 : found->volts[row_];
  }

 private:
  struct Input {
    int64_t input = 0;
    std::vector<double> volts;
  };
  std::vector<Input> inputs_;
  std::vector<bool> missing_;
  double rate_Hz_ = 0;  ///< on the controller's clock
  size_t row_ = 0;
  std::optional<uint64_t> run_start_ns_;
  std::optional<uint64_t> first_ns_;  ///< sample of this run
};

}  // namespace diastole::sim_rig
