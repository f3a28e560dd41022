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
#include <span>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tools/sim_rig/rig_description.hpp"

namespace diastole::sim_rig {

class Playback {
 public:
  /// Throws InputError when the file is no run file, or lacks one of the channels that have inputs.
  Playback(const std::filesystem::path& run_file, const std::vector<DaqChannel>& channels) {
    const runfile::StreamRows pressure = runfile::open_run(run_file).rows.pressure;
    rows_ = pressure.time_s.size();
    if (rows_ < 2) {
      throw InputError({run_file.string(), "/pressure", "holds no samples to play", "Name another run."});
    }
    rate_Hz_ = static_cast<double>(rows_ - 1) / (pressure.time_s.back() - pressure.time_s.front());
    for (const DaqChannel& channel : channels) {
      const auto recorded = pressure.values.find(channel.name + "_kPa");
      if (recorded == pressure.values.end()) {
        throw InputError({run_file.string(), fmt::format("/pressure/{}_kPa", channel.name), "is missing",
                          "Leave that [[daq.channel]] out of the rig file."});
      }
      inputs_.push_back({channel, recorded->second, {}, {}});
    }
    turn_to(0);
  }

  /// The instrument samples now; run_start_ns: RunClock.
  void sample(uint64_t now_ns, std::optional<uint64_t> run_start_ns) {
    turn_to(row_at(now_ns, run_start_ns));
  }
  /// Whether the recording misses this sample.
  [[nodiscard]] bool missing() const {
    return std::ranges::any_of(inputs_, [this](const Input& input) { return std::isnan(kPa(input)); });
  }
  /// Precondition: it is not missing.
  [[nodiscard]] double volts(int64_t input) const {
    const auto found =
        std::ranges::find_if(inputs_, [input](const Input& each) { return each.channel.input == input; });
    return found == inputs_.end() ? 0 : found->channel.zero_V + kPa(*found) / found->channel.kPa_per_V;
  }

 private:
  struct Input {
    DaqChannel channel;
    runfile::Series recorded_kPa;
    std::span<const double> block_kPa;
    std::vector<double> memory_kPa;
  };

  size_t row_at(uint64_t now_ns, std::optional<uint64_t> run_start_ns) {
    if (!run_start_ns || now_ns < *run_start_ns) return 0;
    // A start that is announced, and confirmed a few ns off, is one and the same.
    const bool another_run = !run_start_ns_ || *run_start_ns > *run_start_ns_ + 1'000'000;
    if (another_run) first_ns_ = now_ns;
    run_start_ns_ = run_start_ns;
    const auto index = std::llround(static_cast<double>(now_ns - *first_ns_) * 1e-9 * rate_Hz_);
    return std::min(static_cast<size_t>(index), rows_ - 1);
  }
  /// Has the block at hand in which `row` lies.
  void turn_to(size_t row) {
    row_ = row;
    if (block_rows_ > 0 && row >= first_ && row < first_ + block_rows_) return;
    first_ = row - row % runfile::Series::block_rows;
    block_rows_ = std::min(runfile::Series::block_rows, rows_ - first_);
    for (Input& input : inputs_)
      input.block_kPa = input.recorded_kPa.rows(first_, block_rows_, input.memory_kPa);
  }
  [[nodiscard]] double kPa(const Input& input) const { return input.block_kPa[row_ - first_]; }

  std::vector<Input> inputs_;
  size_t rows_ = 0;
  double rate_Hz_ = 0;  ///< on the controller's clock
  size_t row_ = 0;
  size_t first_ = 0;  ///< of the block
  size_t block_rows_ = 0;
  std::optional<uint64_t> run_start_ns_;
  std::optional<uint64_t> first_ns_;  ///< sample of this run
};

}  // namespace diastole::sim_rig
