#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/contract/plain_text.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/contract/text.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/diastole/runs/catalogue.hpp"
#include "tools/diastole/runs/runs_page.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using catalogue::Catalogue;
using catalogue::Entry;
using catalogue::Found;
using nlohmann::json;

struct RunsOptions {
  std::vector<std::string> words;
  std::string sort = "date";
  bool reverse = false;
  bool rebuild = false;
  bool force = false;
  int64_t most = -1;
  fs::path page;
};

/// Of a page with thumbnails: some 5 MB, which a browser shows at once.
constexpr int64_t most_on_a_page = 2000;

/// The first word that is a folder; the others are what is looked for.
fs::path take_folder(std::vector<std::string>& words) {
  std::error_code ignored;
  if (words.empty() || !fs::is_directory(words.front(), ignored)) {
    if (!words.empty() && words.front().find('/') != std::string::npos &&
        words.front().find('=') == std::string::npos)
      throw InputError(
          {words.front(), "", "is no folder", "Give a folder that exists, then what to look for."});
    return ".";
  }
  fs::path folder = words.front();
  words.erase(words.begin());
  return folder;
}

template <typename Value>
json or_null(const std::optional<Value>& value) {
  return value ? json(*value) : json();
}

json entry_json(const Entry& entry) {
  return {DIASTOLE_NAMED(entry, path, kind, date, specimen, protocol, problem, verdict, effects, parameter,
                         notes),
          {"operator", entry.operator_name},
          {"room_temperature_C", or_null(entry.room_temperature_C)},
          {"duration_s", or_null(entry.duration_s)},
          {"cycles", or_null(entry.cycles)},
          {"peak_kPa", or_null(entry.peak_kPa)},
          {"sound", or_null(entry.sound)},
          {"stiffness_kPa", or_null(entry.stiffness_kPa)},
          {"stiffness_se_kPa", or_null(entry.stiffness_se_kPa)}};
}

void show_table(const std::vector<Entry>& entries) {
  using Row = std::vector<std::string>;
  std::vector<Row> rows{
      {"date", "kind", "specimen", "operator", "protocol", "soundness", "verdict", "stiffness", "file"}};
  for (const Entry& entry : entries) {
    rows.push_back({entry.date.substr(0, 16), entry.kind, entry.specimen, entry.operator_name, entry.protocol,
                    sound_words(entry), entry.verdict + (entry.effects.empty() ? "" : ": " + entry.effects),
                    stiffness_words(entry), entry.path});
    std::ranges::transform(rows.back(), rows.back().begin(), made_plain);
  }
  std::vector<size_t> widths(rows.front().size(), 0);
  for (const Row& row : rows)
    for (size_t i = 0; i < row.size(); ++i)
      widths[i] = std::max(widths[i], characters_of(row[i]));
  for (const Row& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i)
      line += i + 1 == row.size() ? row[i] : row[i] + std::string(widths[i] - characters_of(row[i]) + 2, ' ');
    fmt::print("{}\n", line);
  }
}

/// On standard error, beyond two seconds.
class ProgressLine {
 public:
  void show(int64_t read, int64_t of) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + interval;
    fmt::print(stderr, "read {} of {} files that are new or have changed\n", read, of);
  }

 private:
  static constexpr std::chrono::seconds interval{2};
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + interval;
};

/// A folder's name that was mistyped, or came second, is a word that stands nowhere.
ExitCode report_found_nowhere(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    std::error_code ignored;
    fmt::print(
        stderr, "diastole: {}: {}, and stands in no text of the files\n  {}\n", made_plain(word),
        fs::is_directory(word, ignored) ? "is another folder than the one that is searched" : "is no folder",
        "Give one folder that exists, first, then what to look for.");
  }
  return words.empty() ? ExitCode::done : ExitCode::negative;
}

ExitCode runs(RunsOptions options, const CommandOutput& out) {
  const fs::path folder = fs::canonical(take_folder(options.words));
  const catalogue::Condition condition = catalogue::condition_of(options.words);
  if (std::ranges::find(catalogue::keys(), options.sort) == catalogue::keys().end())
    throw InputError({"", "--sort " + options.sort, "is no key",
                      fmt::format("{}Known are {}.", did_you_mean(options.sort, catalogue::keys()),
                                  fmt::join(catalogue::keys(), ", "))});
  if (!options.page.empty()) require_output({options.page, {}, report::page_mark, options.force});
  const fs::path index = catalogue::index_of(folder);
  Catalogue known(folder, index);
  if (options.rebuild) known.forget();
  ProgressLine progress;
  const catalogue::Refreshed refreshed =
      known.refresh([&](int64_t read, int64_t of) { progress.show(read, of); });
  // Times run backward from the newest, texts and numbers forward.
  const bool rising = (options.sort != "date") != options.reverse;
  int64_t most = options.most;
  if (most < 0 && !options.page.empty()) most = most_on_a_page;
  const Found found = known.find({condition, options.sort, rising, most});
  const ExitCode code =
      found.matched > 0 ? ExitCode::done : report_found_nowhere(known.found_nowhere(options.words));
  if (!options.page.empty()) {
    write_whole_file(
        options.page,
        catalogue::runs_page(folder.string(), fmt::format("{}", fmt::join(options.words, ", ")), found));
  }
  if (out.json) {
    json document{{"folder", folder.string()},
                  {"index", index.string()},
                  {"files", refreshed.files},
                  {"read", refreshed.read},
                  {"removed", refreshed.removed},
                  {"matched", found.matched},
                  {"entries", json::array()},
                  {"page", options.page.empty() ? json() : json(options.page.string())}};
    for (const Entry& entry : found.entries)
      document["entries"].push_back(entry_json(entry));
    std::cout << json_text(document, 2) << '\n';
    return code;
  }
  if (!options.page.empty()) {
    fmt::print("{} of {} are on {}\n", found.entries.size(), found.matched, options.page.string());
    return code;
  }
  if (!found.entries.empty()) show_table(found.entries);
  fmt::print("{} of {} files in {}\n", found.matched, refreshed.files, folder.string());
  return code;
}

}  // namespace

void add_runs(CommandLine& line) {
  auto options = std::make_shared<RunsOptions>();
  CLI::App* command = line.add(
      "runs", "find runs again: a catalogue of a folder's runs, fits, explanations and images",
      "  diastole runs\n"
      "      all below this folder, the newest first\n"
      "  diastole runs ~/sessions specimen=gel-7 since=2026-11 verdict=unexplained\n"
      "  diastole runs 'stiffness_kPa<9' sound=yes bubble --sort stiffness_kPa\n"
      "      a word alone may stand in any text: specimen, protocol, notes, problem, ...\n"
      "  diastole runs kind=run -o runs.html\n"
      "      a page with a thumbnail of each run's pressure\n"
      "The index over a folder lies in your cache and is brought up to date by the files' sizes and "
      "times; it\n"
      "may be deleted at any time. A run has the verdict and the stiffness of the last explanation "
      "and fit whose\n"
      "study names it. Crates (diastole export --ro-crate) hold copies: each is a folder to be asked "
      "by itself.\n"
      "Exit code 1: a word alone is no folder, and stands nowhere.");
  command->add_option(
      "WORDS", options->words,
      "folder (default: this one), then KEY=VALUE, KEY<NUMBER, KEY>NUMBER, KEY!=VALUE or words");
  command->add_option("--sort", options->sort, "key to sort by")->capture_default_str();
  command->add_flag("--reverse", options->reverse, "the other way round");
  command->add_option("--most", options->most, "show at most so many")->check(nonnegative_number);
  command->add_option("-o,--output", options->page, "HTML page to write");
  command->add_flag("--force", options->force, "replace an output file that is no report");
  command->add_flag("--rebuild", options->rebuild, "read all files anew");
  line.on_run(command, [options](const CommandOutput& out) { return runs(*options, out); });
}

}  // namespace diastole
