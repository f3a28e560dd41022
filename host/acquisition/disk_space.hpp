#pragma once
// Whether a disk can hold a run, before anything moves.

#include <cstdint>
#include <filesystem>

namespace diastole {

struct RunSize {
  double duration_s = 0;
  double sample_rate_Hz = 0;
  double position_rate_Hz = 0;
  uint64_t channels = 1;
  uint64_t cycles = 0;
  double gaps_Hz =
      10;  ///< to be reckoned with; an instrument that cannot keep the rate makes up to half the rate
};

struct DiskSpace {
  uint64_t journal_bytes = 0;
  uint64_t run_file_bytes = 0;
  [[nodiscard]] uint64_t total_bytes() const { return journal_bytes + run_file_bytes; }
};

/// What the run's journal and the run file beside it come to, a tenth and some room for events included.
DiskSpace required_space(const RunSize& run);

/// Throws InputError that states what is needed and what is free, if the directory's disk cannot hold the run.
void check_disk_space(const std::filesystem::path& directory, const RunSize& run);

}  // namespace diastole
