#include "host/journal/journal_store.hpp"

#include <algorithm>
#include <fstream>
#include <string>
#include <string_view>

namespace diastole {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view hdf5_signature{"\x89HDF\r\n\x1a\n", 8};
constexpr std::string_view journal_signature{"DJR1"};

bool begins_with(const fs::path& file, std::string_view signature) {
  std::string head(signature.size(), '\0');
  std::ifstream stream(file, std::ios::binary);
  return stream.read(head.data(), static_cast<std::streamsize>(head.size())) && head == signature;
}

}  // namespace

bool is_journal(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored) && begins_with(file, journal_signature);
}

fs::path run_file_beside(fs::path journal) { return journal.replace_extension(".run.h5"); }

std::vector<StoredJournal> stored_journals(const fs::path& directory) {
  std::vector<StoredJournal> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(directory, ignored)) {
    if (entry.path().extension() != ".journal" || !entry.is_regular_file(ignored)) continue;
    StoredJournal journal{entry.path(), entry.file_size(ignored), false, {}};
    const fs::path run_file = run_file_beside(entry.path());
    journal.has_run_file = begins_with(run_file, hdf5_signature);
    if (journal.has_run_file) journal.run_file_written = fs::last_write_time(run_file, ignored);
    found.push_back(journal);
  }
  std::sort(found.begin(), found.end(),
            [](const StoredJournal& a, const StoredJournal& b) { return a.file < b.file; });
  return found;
}

std::vector<fs::path> prune_journals(const fs::path& directory, fs::file_time_type before) {
  std::vector<fs::path> removed;
  for (const StoredJournal& journal : stored_journals(directory)) {
    std::error_code ignored;
    if (!journal.has_run_file || journal.run_file_written >= before) continue;
    if (fs::remove(journal.file, ignored)) removed.push_back(journal.file);
  }
  return removed;
}

}  // namespace diastole
