#pragma once
// The index over a folder's runs and what was made of them. It holds nothing that is not in the files: it may be deleted at any
// time, and is brought up to date whenever it is asked, by the files' sizes and times.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/diastole/runs/database.hpp"
#include "tools/diastole/runs/entry.hpp"
#include "tools/diastole/runs/filter.hpp"

namespace diastole::catalogue {

struct Refreshed {
  int64_t files = 0;    ///< that the folder holds
  int64_t read = 0;     ///< of them, because they were new or had changed
  int64_t removed = 0;  ///< that are gone
};

struct Query {
  Condition condition;
  std::string sort = "date";  ///< a key (filter.hpp)
  bool rising = false;
  int64_t most = -1;  ///< -1: all
};

struct Found {
  std::vector<Entry> entries;  ///< at most query.most; without `runs`
  int64_t matched = 0;         ///< in all
};

class Catalogue {
 public:
  /// Called now and then with how many of how many changed files were read.
  using Progress = std::function<void(int64_t read, int64_t of)>;

  /// `folder` exists; what lies in a crate below it (host/runfile/ro_crate.hpp) is a copy, and left out. `index`: the database's
  /// file, made anew if it is none of this program's.
  Catalogue(std::filesystem::path folder, const std::filesystem::path& index);

  /// What was read so far is kept if the program is ended meanwhile.
  Refreshed refresh(const Progress& progress);
  /// Begins from nothing with the next refresh.
  void forget();
  [[nodiscard]] Found find(const Query& query) const;
  /// Those of the words that stand alone, without a key, and in no text of any entry.
  [[nodiscard]] std::vector<std::string> found_nowhere(const std::vector<std::string>& words) const;

 private:
  void prepare();
  void keep(const Entry& entry, int64_t size, int64_t mtime_ns);
  void relate();

  std::filesystem::path folder_;
  Database database_;
};

/// Where a folder's index lies: in the user's cache (estimator/io/cache_folder.hpp), or in memory without one.
std::filesystem::path index_of(const std::filesystem::path& folder);

}  // namespace diastole::catalogue
