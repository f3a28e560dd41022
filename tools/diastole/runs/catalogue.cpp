#include "tools/diastole/runs/catalogue.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <map>
#include <unordered_map>
#include <unordered_set>

#include "estimator/io/cache_folder.hpp"
#include "estimator/io/fingerprint.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::catalogue {
namespace {

namespace fs = std::filesystem;

/// Of the tables below; another one is an index of another version, and is made anew.
constexpr int64_t index_version = 1;
/// Read files are kept so often: ended meanwhile, no more than these are read again.
constexpr int64_t kept_together = 200;

constexpr const char* tables = R"(
create table entries(path text primary key, size integer, mtime_ns integer, kind text, date text, specimen text,
  operator text, room_temperature_C real, protocol text, duration_s real, cycles integer, peak_kPa real, sound integer,
  problem text, verdict text, effects text, parameter text, stiffness_kPa real, stiffness_se_kPa real, notes text,
  trace blob);
create index by_date on entries(date);
create index by_specimen on entries(specimen collate nocase);
create table rests_on(result text, run text, primary key(result, run)) without rowid;
create index by_run on rests_on(run);
create table known(path text primary key, size integer, mtime_ns integer) without rowid;
)";

/// A run has the verdict of the last explanation, and the stiffness of the last fit or else explanation, that rest on it; those
/// have the specimen and the operator of their runs.
constexpr const char* relations = R"(
update entries set verdict = '', effects = '', parameter = '', stiffness_kPa = null, stiffness_se_kPa = null
  where kind = 'run' and (verdict <> '' or parameter <> '');
update entries set (verdict, effects) = (select e.verdict, e.effects from rests_on r join entries e on e.path = r.result
    where r.run = entries.path and e.kind = 'explanation' order by e.date desc limit 1)
  where kind = 'run' and path in (select run from rests_on join entries e on e.path = result where e.kind = 'explanation');
update entries set (parameter, stiffness_kPa, stiffness_se_kPa) = (select e.parameter, e.stiffness_kPa, e.stiffness_se_kPa
    from rests_on r join entries e on e.path = r.result where r.run = entries.path and e.stiffness_kPa is not null
    order by e.kind = 'fit' desc, e.date desc limit 1)
  where kind = 'run' and path in (select run from rests_on join entries e on e.path = result where e.stiffness_kPa is not null);
update entries set
    specimen = coalesce((select e.specimen from rests_on r join entries e on e.path = r.run
      where r.result = entries.path and e.specimen <> '' limit 1), ''),
    operator = coalesce((select e.operator from rests_on r join entries e on e.path = r.run
      where r.result = entries.path and e.operator <> '' limit 1), '')
  where kind in ('fit', 'explanation');
)";

struct Stamp {
  int64_t size = 0;
  int64_t mtime_ns = 0;
  bool operator==(const Stamp&) const = default;
};

std::optional<Stamp> stamp_of(const fs::path& file) {
  struct stat state {};
  if (::stat(file.c_str(), &state) != 0) return std::nullopt;
  return Stamp{state.st_size, state.st_mtim.tv_sec * int64_t{1'000'000'000} + state.st_mtim.tv_nsec};
}

struct Images {
  int64_t files = 0;
  Stamp stamp;  ///< all sizes, the newest time
};

struct Folder {
  std::vector<std::pair<std::string, Stamp>> files;  ///< candidates, by their path from the folder
  std::map<std::string, Images> images;
};

/// Folders whose names begin with a dot, crates (ro_crate.hpp), which hold copies, and those that may not be read, are left out.
Folder look_through(const fs::path& folder) {
  Folder found;
  const size_t skipped = folder.native().size() + 1;
  const auto from_folder = [&](const fs::path& path) {
    return path.native().size() < skipped ? std::string(".") : path.native().substr(skipped);
  };
  for (fs::recursive_directory_iterator each(folder, fs::directory_options::skip_permission_denied), end;
       each != end; ++each) {
    const fs::path& path = each->path();
    std::error_code ignored;
    if (path.filename().native().starts_with('.') ||
        (each->is_directory(ignored) && fs::exists(path / "ro-crate-metadata.json", ignored))) {
      each.disable_recursion_pending();
      continue;
    }
    const bool is_image = path.native().ends_with(".dcm") || path.native().ends_with(".DCM");
    if ((!is_image && candidate_of(path) == Candidate::none) || !each->is_regular_file()) continue;
    const auto stamp = stamp_of(path);
    if (!stamp) continue;
    if (is_image) {
      Images& images = found.images[from_folder(path.parent_path())];
      ++images.files;
      images.stamp.size += stamp->size;
      images.stamp.mtime_ns = std::max(images.stamp.mtime_ns, stamp->mtime_ns);
    } else {
      found.files.emplace_back(from_folder(path), *stamp);
    }
  }
  return found;
}

std::unordered_map<std::string, Stamp> known_files(const Database& database) {
  std::unordered_map<std::string, Stamp> known;
  Statement all(database, "select path, size, mtime_ns from known");
  while (all.step())
    known.emplace(all.text(0), Stamp{all.whole(1), all.whole(2)});
  return known;
}

fs::path usable(const fs::path& index) {
  if (index == ":memory:") return index;
  try {
    const Database database(index);
    Statement version(database, "pragma user_version");
    if (version.step() && (version.whole(0) == index_version || version.whole(0) == 0)) return index;
  } catch (const DatabaseError&) {  // no database, or a damaged one
  }
  std::error_code ignored;
  fs::remove(index, ignored);
  return index;
}

void bind_values(Statement& statement, const Condition& condition) {
  for (size_t i = 0; i < condition.values.size(); ++i) {
    std::visit([&](const auto& value) { statement.bind(static_cast<int>(i), value); }, condition.values[i]);
  }
}

Entry entry_in(const Statement& row) {
  Entry entry{.path = row.text(0),
              .kind = row.text(1),
              .date = row.text(2),
              .specimen = row.text(3),
              .operator_name = row.text(4)};
  entry.room_temperature_C = row.number_if(5);
  entry.protocol = row.text(6);
  entry.duration_s = row.number_if(7);
  entry.cycles = row.whole_if(8);
  entry.peak_kPa = row.number_if(9);
  if (const auto sound = row.whole_if(10)) entry.sound = *sound != 0;
  entry.problem = row.text(11);
  entry.verdict = row.text(12);
  entry.effects = row.text(13);
  entry.parameter = row.text(14);
  entry.stiffness_kPa = row.number_if(15);
  entry.stiffness_se_kPa = row.number_if(16);
  entry.notes = row.text(17);
  entry.trace = row.numbers(18);
  return entry;
}

}  // namespace

fs::path index_of(const fs::path& folder) {
  const fs::path cache = cache_folder();
  std::error_code failure;
  if (cache.empty() || (fs::create_directories(cache, failure), failure)) return ":memory:";
  return cache / fmt::format("runs-{}.sqlite", fingerprint_of(folder.string()));
}

Catalogue::Catalogue(fs::path folder, const fs::path& index)
    : folder_(std::move(folder)), database_(usable(index)) {
  // What a power cut takes is read again from the files.
  database_.execute("pragma synchronous = off; pragma journal_mode = memory;");
  prepare();
}

void Catalogue::prepare() {
  Statement version(database_, "pragma user_version");
  if (version.step() && version.whole(0) == index_version) return;
  database_.execute(
      fmt::format("begin immediate; {} pragma user_version = {}; commit;", tables, index_version));
}

void Catalogue::forget() {
  database_.execute("begin immediate; delete from entries; delete from rests_on; delete from known; commit;");
}

void Catalogue::keep(const Entry& entry, int64_t size, int64_t mtime_ns) {
  Statement insert(database_,
                   "insert or replace into entries values(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  int at = 0;
  const auto bind = [&](const auto& value) { insert.bind(at++, value); };
  bind(std::string_view(entry.path));
  bind(size);
  bind(mtime_ns);
  bind(std::string_view(entry.kind));
  bind(entry.date.empty() ? utc_text(mtime_ns) : entry.date);
  bind(std::string_view(entry.specimen));
  bind(std::string_view(entry.operator_name));
  bind(entry.room_temperature_C);
  bind(std::string_view(entry.protocol));
  bind(entry.duration_s);
  bind(entry.cycles);
  bind(entry.peak_kPa);
  bind(entry.sound ? std::optional<int64_t>(*entry.sound ? 1 : 0) : std::nullopt);
  for (const std::string* text : {&entry.problem, &entry.verdict, &entry.effects, &entry.parameter})
    bind(std::string_view(*text));
  bind(entry.stiffness_kPa);
  bind(entry.stiffness_se_kPa);
  bind(std::string_view(entry.notes));
  bind(std::span<const float>(entry.trace));
  insert.step();
  Statement rests(database_, "insert or ignore into rests_on values(?,?)");
  for (const std::string& run : entry.runs) {
    rests.bind(0, std::string_view(entry.path));
    rests.bind(1, std::string_view(run));
    rests.step();
  }
}

void Catalogue::relate() { database_.execute(relations); }

Refreshed Catalogue::refresh(const Progress& progress) {
  const Folder found = look_through(folder_);
  std::unordered_map<std::string, Stamp> gone = known_files(database_);
  std::vector<std::pair<std::string, Stamp>> changed;
  std::vector<std::pair<std::string, Images>> changed_images;
  const auto is_known = [&](const std::string& path, const Stamp& stamp) {
    const auto known = gone.find(path);
    const bool same = known != gone.end() && known->second == stamp;
    if (same) gone.erase(known);
    return same;
  };
  for (const auto& [path, stamp] : found.files)
    if (!is_known(path, stamp)) changed.emplace_back(path, stamp);
  for (const auto& [path, images] : found.images)
    if (!is_known(path, images.stamp)) changed_images.emplace_back(path, images);
  Refreshed refreshed{static_cast<int64_t>(found.files.size() + found.images.size()),
                      static_cast<int64_t>(changed.size() + changed_images.size()), 0};
  if (refreshed.read == 0 && gone.empty()) return refreshed;

  database_.execute("begin immediate");
  for (const auto& [path, stamp] : gone) {
    for (const char* sql : {"delete from entries where path = ?", "delete from rests_on where result = ?",
                            "delete from known where path = ?"}) {
      Statement statement(database_, sql);
      statement.bind(0, std::string_view(path));
      statement.step();
    }
  }
  refreshed.removed =
      static_cast<int64_t>(gone.size()) -
      std::ranges::count_if(changed, [&](const auto& each) { return gone.contains(each.first); }) -
      std::ranges::count_if(changed_images, [&](const auto& each) { return gone.contains(each.first); });
  const auto remember = [&](const std::string& path, const Stamp& stamp) {
    Statement statement(database_, "insert or replace into known values(?,?,?)");
    statement.bind(0, std::string_view(path));
    statement.bind(1, stamp.size);
    statement.bind(2, stamp.mtime_ns);
    statement.step();
  };
  int64_t done = 0;
  for (const auto& [path, stamp] : changed) {
    if (const auto entry = read_entry(folder_, folder_ / path)) keep(*entry, stamp.size, stamp.mtime_ns);
    remember(path, stamp);
    if (++done % kept_together == 0) database_.execute("commit; begin immediate");
    progress(done, refreshed.read);
  }
  for (const auto& [path, images] : changed_images) {
    keep(images_entry(folder_, folder_ / path, images.files, images.stamp.mtime_ns), images.stamp.size,
         images.stamp.mtime_ns);
    remember(path, images.stamp);
    progress(++done, refreshed.read);
  }
  relate();
  database_.execute("commit");
  return refreshed;
}

std::vector<std::string> Catalogue::found_nowhere(const std::vector<std::string>& words) const {
  std::vector<std::string> nowhere;
  for (const std::string& word : words)
    if (is_word_alone(word) && find({.condition = condition_of({word}), .most = 0}).matched == 0)
      nowhere.push_back(word);
  return nowhere;
}

Found Catalogue::find(const Query& query) const {
  Found found;
  Statement count(database_, "select count(*) from entries where " + query.condition.sql);
  bind_values(count, query.condition);
  if (count.step()) found.matched = count.whole(0);
  // What is not known comes last, whichever way is sorted.
  Statement rows(
      database_,
      fmt::format(
          "select path, kind, date, specimen, operator, room_temperature_C, protocol, duration_s, cycles, "
          "peak_kPa, sound, problem, verdict, effects, parameter, stiffness_kPa, stiffness_se_kPa, notes, "
          "trace from entries where {} order by \"{}\" is null or \"{}\" = '', \"{}\" {}, path limit {}",
          query.condition.sql, query.sort, query.sort, query.sort, query.rising ? "asc" : "desc",
          query.most));
  bind_values(rows, query.condition);
  while (rows.step())
    found.entries.push_back(entry_in(rows));
  return found;
}

}  // namespace diastole::catalogue
