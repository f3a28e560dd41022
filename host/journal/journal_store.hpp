#pragma once
// The directory of the daemon's journals: RUN_ID.journal, and beside it RUN_ID.run.h5, the run file that was
// made of it.
//
// What is kept: a journal without a run file for ever, because it may be all there is of a run; a journal with
// a run file for some days after that was written, in case the file turns out to be damaged; run files for
// ever. Nothing else in the directory is touched.

#include <cstdint>
#include <filesystem>
#include <vector>

namespace diastole {

struct StoredJournal {
  std::filesystem::path file;
  uint64_t bytes = 0;
  bool has_run_file = false;  ///< beside it, and begins like one
  std::filesystem::file_time_type run_file_written{};
};

/// In order of their names. A directory that cannot be read has none.
std::vector<StoredJournal> stored_journals(const std::filesystem::path& directory);

/// RUN_ID.run.h5 beside RUN_ID.journal.
std::filesystem::path run_file_beside(std::filesystem::path journal);

/// Removes the journals whose run file was written before `before`; returns them.
std::vector<std::filesystem::path> prune_journals(const std::filesystem::path& directory,
                                                  std::filesystem::file_time_type before);

/// Whether the file begins as a journal does.
bool is_journal(const std::filesystem::path& file);

}  // namespace diastole
