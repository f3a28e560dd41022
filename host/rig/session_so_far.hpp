#pragma once
// What a session of slices has come to, by the journals that its runs have left: a session that was broken off, by a crash, a
// fault or a stop, goes on with the first slice that was not imaged whole.
//
// A session's runs are journals of one experiment, identified by its text; each names the run before it (BeginRecord::resumes) and the
// slices that were done by then. So the newest journal that no other names knows all of them.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include "host/config/schedule.hpp"
#include "host/journal/parsed_journal.hpp"

namespace diastole {

/// The slices, of all, that the run's journal holds whole: the trigger of each of their cycles, and both streams until the last of
/// these has ended. Those of earlier runs are not among them.
std::set<int64_t> imaged_slices(const ParsedJournal& parsed, const Schedule& schedule);

struct SessionSoFar {
  std::string run_id;  ///< of its newest run
  std::string started_utc;
  std::filesystem::path journal;
  std::set<int64_t> done;  ///< slices, of all
};

/// The session of this experiment that was begun or went on last. None: no journal in the directory is of it. Throws InputError
/// when its newest journal cannot be read.
std::optional<SessionSoFar> last_session(const std::filesystem::path& journal_dir,
                                         const std::string& experiment, const Schedule& schedule);

}  // namespace diastole
