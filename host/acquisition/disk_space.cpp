#include "host/acquisition/disk_space.hpp"

#include <fmt/format.h>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr double record_bytes = 20;  // header and CRC of host/journal/journal.hpp
constexpr double number_bytes = 8;
constexpr double margin = 1.1;
constexpr double events_bytes = 128e3;

double journal_bytes_s(const RunSize& run) {
  constexpr double blocks_s = 10;            // of samples
  constexpr double block_bytes = 16;         // header
  constexpr double batch_positions = 30;     // at least, see the controller's telemetry
  constexpr double batch_bytes = 20;         // header
  constexpr double gap_bytes = 120;          // its reason in words
  constexpr double documents_bytes_s = 800;  // clock pairs of controller and instrument
  return run.sample_rate_Hz * number_bytes * (1 + static_cast<double>(run.channels)) +
         blocks_s * (record_bytes + block_bytes) +
         run.position_rate_Hz * (sizeof(int32_t) + (record_bytes + batch_bytes) / batch_positions) +
         run.gaps_Hz *
             (record_bytes + gap_bytes + record_bytes + block_bytes) +  // and the block that it ends
         documents_bytes_s;
}

double run_file_bytes_s(const RunSize& run) {
  const double columns = 2 + static_cast<double>(run.channels);  // time, channels, filtered
  constexpr double gap_bytes = 160;                              // two numbers, two texts
  return number_bytes * (run.sample_rate_Hz * columns + run.position_rate_Hz * 2) + gap_bytes * run.gaps_Hz;
}

std::string megabytes(uint64_t bytes) { return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes)); }

}  // namespace

DiskSpace required_space(const RunSize& run) {
  constexpr double cycle_bytes = 150;  // trigger and segment records
  const double cycles = static_cast<double>(run.cycles);
  return {static_cast<uint64_t>(events_bytes +
                                margin * (journal_bytes_s(run) * run.duration_s + cycle_bytes * cycles)),
          static_cast<uint64_t>(events_bytes +
                                margin * (run_file_bytes_s(run) * run.duration_s + number_bytes * cycles))};
}

void check_disk_space(const std::filesystem::path& directory, const RunSize& run) {
  std::error_code error;
  const auto space = std::filesystem::space(directory, error);
  const DiskSpace needed = required_space(run);
  if (error || space.available >= needed.total_bytes()) return;
  throw InputError({directory.string(), "",
                    fmt::format("has {} free, and a run of {:.0f} s needs about {} (journal {}, run file {})",
                                megabytes(space.available), run.duration_s, megabytes(needed.total_bytes()),
                                megabytes(needed.journal_bytes), megabytes(needed.run_file_bytes)),
                    "Free some room there, name another journal_dir in the rig file, or shorten the run."});
}

}  // namespace diastole
