#pragma once
// A recorded run's pressure at the instrument's inputs, in place of the plant's.
//
// The k-th sample after the start of run is answered with the k-th of the recording, volts = zero_V + kPa / kPa_per_V,
// and fails where the recording has a gap. So rows keep their partners whatever lies between the start of run and the
// first sample; that start phase differs from the recording's by less than a sample. Before the run the inputs show
// the first sample, behind the recording's end the last.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "tools/sim_rig/rig_description.hpp"

namespace diastole::sim_rig {

class Playback {
 public:
  /// Throws InputError when the file is no run file, or lacks one of the channels that have inputs.
  Playback(const std::filesystem::path& run_file, const std::vector<DaqChannel>& channels);

  /// The instrument samples now; run_start_ns: RunClock.
  void sample(uint64_t now_ns, std::optional<uint64_t> run_start_ns);
  /// Whether the recording misses this sample.
  [[nodiscard]] bool missing() const { return missing_[row_]; }
  [[nodiscard]] double volts(int64_t input) const;

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
