#pragma once
// A journal as the daemon leaves it, of any length, without a run: noise on every channel, a pump that is at rest, one
// trigger a second.

#include <filesystem>

namespace diastole {

struct JournalLoad {
  int channels = 10;
  double rate_Hz = 10'000;
  int seconds = 20;
};

/// Throws HardwareError when the disk does not take it.
void write_long_journal(const std::filesystem::path& path, const JournalLoad& load);

}  // namespace diastole
