#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <ctime>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/journal/part_file.hpp"
#include "host/runfile/bids_export.hpp"
#include "host/runfile/output_guard.hpp"
#include "host/runfile/ro_crate.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/contract/waiting_line.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct ExportOptions {
  std::vector<fs::path> runs;
  fs::path bids;
  std::string subject = "01";
  std::string task;
  fs::path crate;
  std::vector<fs::path> also;
  std::string license;
  bool force = false;
};

/// BIDS labels are letters and digits only.
std::string label(const std::string& option, const std::string& text) {
  const bool fits =
      !text.empty() && std::ranges::all_of(text, [](unsigned char c) { return std::isalnum(c) != 0; });
  if (!fits) {
    throw InputError(
        {"", fmt::format("{} {}", option, text), "is no BIDS label", "Use letters and digits only."});
  }
  return text;
}

std::string task_of(const fs::path& run) {
  std::string task;
  for (const char c : run.stem().stem().string())
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) task += c;
  return task.empty() ? "run" : task;
}

/// A folder to export into, or none if it is not named. Unless it is kept, what was made of it goes again with all that is in it.
class ExportFolder {
 public:
  explicit ExportFolder(const fs::path& folder) {
    if (folder.empty()) return;
    std::error_code error;
    const auto is_missing = [&](const fs::path& path) {
      return fs::symlink_status(path, error).type() == fs::file_type::not_found;
    };
    for (fs::path each = fs::absolute(folder); is_missing(each); each = each.parent_path())
      made_ = each;
    fs::create_directories(folder, error);
    if (fs::is_directory(folder, error) && ::access(folder.c_str(), W_OK | X_OK) == 0) return;
    remove();
    throw InputError({folder.string(), "", "is no folder that can be written into",
                      "Name another folder, or one that can be made."});
  }
  ~ExportFolder() { remove(); }
  ExportFolder(const ExportFolder&) = delete;
  ExportFolder& operator=(const ExportFolder&) = delete;

  void keep() { made_.clear(); }

 private:
  void remove() {
    std::error_code ignored;
    if (!made_.empty()) fs::remove_all(made_, ignored);
  }
  fs::path made_;  ///< the uppermost that was not there
};

/// The address of a licence that is named by its address or as https://spdx.org/licenses names it.
std::string license_address(const std::string& text) {
  static const std::vector<std::string> spdx{
      "CC0-1.0",  "CC-BY-4.0",  "CC-BY-SA-4.0", "CC-BY-NC-4.0", "CC-BY-NC-SA-4.0",
      "ODbL-1.0", "ODC-By-1.0", "PDDL-1.0",     "MIT",          "Apache-2.0"};
  static const std::regex address(R"(https://[A-Za-z0-9.-]+\.[A-Za-z]+(:\d+)?(/[!-~]*)?)");
  if (std::ranges::count(spdx, text) > 0) return "https://spdx.org/licenses/" + text;
  if (text.size() > 2000 || !std::regex_match(text, address)) {
    throw InputError({"", "--license",
                      fmt::format("\"{}\" is neither an https address nor a known licence", text),
                      fmt::format("{}Give an address as https://spdx.org/licenses/CC-BY-4.0, or one of {}.",
                                  did_you_mean(text, spdx), fmt::join(spdx, ", "))});
  }
  return text;
}

/// One run's table and description.
struct BidsFiles {
  fs::path table;
  fs::path description;
};

BidsFiles bids_files(const ExportOptions& options, const runfile::RunFile& file) {
  const auto& [run, rows] = file;
  const std::string task = options.task.empty() ? task_of(run.file) : label("--task", options.task);
  const fs::path stem =
      options.bids / fmt::format("sub-{}_task-{}_physio", label("--subject", options.subject), task);
  BidsFiles files{stem.string() + ".tsv.gz", stem.string() + ".json"};
  if (rows.pressure.time_s.size() < 2) {
    throw InputError({run.file, "dataset /pressure/time_s", "holds fewer than two samples",
                      "There is nothing to export."});
  }
  return files;
}

/// Of all runs: no two have the same.
std::vector<BidsFiles> bids_files(const ExportOptions& options, const std::vector<runfile::RunFile>& runs) {
  std::vector<BidsFiles> files;
  std::map<fs::path, std::string> run_of;
  for (const runfile::RunFile& file : runs) {
    files.push_back(bids_files(options, file));
    const auto [other, is_new] = run_of.try_emplace(files.back().table, file.run.file);
    if (!is_new) {
      throw InputError(
          {file.run.file, "",
           fmt::format("would be {}, as {} is", files.back().table.filename().string(), other->second),
           "BIDS names keep only a run file's letters and digits: rename one, or export each with a --task "
           "of its own."});
    }
  }
  return files;
}

json write_bids(const BidsFiles& files, const runfile::RunFile& file) {
  const WaitingLine waiting("writing " + files.table.string());
  const nlohmann::ordered_json description = bids_description(file);
  write_bids_table(file, files.table);
  write_text_file(files.description, json_text(description, 2) + "\n");
  return {{"run", file.run.file},
          {"table", files.table.string()},
          {"description", files.description.string()},
          {"columns", description.at("Columns")},
          {"rows", file.rows.pressure.time_s.size()}};
}

constexpr const char* metadata_file = "ro-crate-metadata.json";

/// The names that files get in the crate. Throws InputError if two would have the same, or one is there already.
std::vector<fs::path> crated_names(const ExportOptions& options) {
  std::vector<fs::path> names{metadata_file};
  for (const fs::path& run : options.runs) {
    names.push_back(run.filename());
    names.push_back(run.stem().stem().string() + ".experiment.toml");
  }
  for (const fs::path& file : options.also) {
    std::error_code missing;
    if (!fs::exists(file, missing))
      throw InputError({file.string(), "--also", "is not there", "Name a file or a folder."});
    names.push_back((file.filename().empty() ? file.parent_path() : file).filename());
  }
  std::set<fs::path> used_names;
  for (const fs::path& name : names) {
    if (!used_names.insert(name).second)
      throw InputError({name.string(), "", "is the name of two files of the crate", "Rename one of them."});
    std::error_code missing;
    if (!options.force && fs::exists(options.crate / name, missing))
      throw InputError({(options.crate / name).string(), "", "exists already",
                        "Choose another folder, or --force to replace it."});
  }
  return names;
}

fs::path write_crate(const ExportOptions& options, const std::vector<runfile::RunFile>& runs) {
  const WaitingLine waiting("writing " + options.crate.string());
  Crate crate{.title = fmt::format("Diastole session of {}", runs.front().run.started_utc),
              .published_utc = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))),
              .runs = {},
              .others = {}};
  if (!options.license.empty()) crate.license = license_address(options.license);
  for (size_t i = 0; i < runs.size(); ++i) {
    const fs::path& file = options.runs[i];
    crate.runs.push_back({file.filename().string(), file.stem().stem().string() + ".experiment.toml",
                          runs[i].run, runfile::read_session(file)});
    copy_durably(file, options.crate / crate.runs.back().name);
    write_text_file(options.crate / crate.runs.back().experiment, runs[i].run.protocol_toml);
  }
  for (const fs::path& file : options.also) {
    const bool is_folder = fs::is_directory(file);
    const std::string name = (file.filename().empty() ? file.parent_path() : file).filename().string();
    if (is_folder) {
      fs::copy(file, options.crate / name,
               fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    } else {
      copy_durably(file, options.crate / name);
    }
    crate.others.push_back({is_folder ? name + "/" : name, name});
  }
  // Last: a folder without it is no crate.
  write_text_file(options.crate / metadata_file, json_text(ro_crate(crate, options.crate), 2) + "\n");
  return options.crate / metadata_file;
}

ExitCode export_runs(const ExportOptions& options, const CommandOutput& out) {
  if (options.bids.empty() && options.crate.empty())
    throw InputError(
        {"", "export", "nothing to export to", "Give --bids FOLDER, --ro-crate FOLDER or both."});
  if (options.runs.size() > 1 && !options.task.empty())
    throw InputError(
        {"", "--task", "is one label for several runs", "Leave it out: each run gets its file's name."});
  if (!options.license.empty()) (void)license_address(options.license);
  std::vector<runfile::RunFile> runs;
  for (const fs::path& file : options.runs) {
    const WaitingLine waiting("reading " + file.string());
    runs.push_back(runfile::open_run(file));
  }
  std::vector<BidsFiles> files;
  if (!options.bids.empty()) files = bids_files(options, runs);
  if (!options.crate.empty()) (void)crated_names(options);
  ExportFolder bids(options.bids), crate(options.crate);
  for (const BidsFiles& each : files) {
    require_new_file(each.table, options.force);
    require_new_file(each.description, options.force);
  }
  json document{{"bids", json::array()}, {"ro_crate", nullptr}};
  for (size_t i = 0; i < files.size(); ++i)
    document["bids"].push_back(write_bids(files[i], runs[i]));
  try {
    if (!options.crate.empty()) document["ro_crate"] = write_crate(options, runs).string();
  } catch (const fs::filesystem_error& error) {
    throw HardwareError(options.crate.string(), error.what(),
                        "Check the space on the disk and that you may write there.");
  }
  bids.keep();
  crate.keep();
  // A single run's table, as it was printed before there were crates.
  if (files.size() == 1) document.update(document["bids"].front());
  print(out, document, [&] {
    for (const BidsFiles& each : files)
      fmt::print("{}\n{}\n", each.table.string(), each.description.string());
    if (!options.crate.empty()) fmt::print("{}\n", document["ro_crate"].get<std::string>());
  });
  return ExitCode::done;
}

}  // namespace

void add_export(CommandLine& line) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* command = line.add(
      "export", "runs as BIDS physiological recordings, or a session as an RO-Crate",
      "  diastole export gel.run.h5 --bids study/sub-01/func --subject 01 --task gel\n"
      "      writes sub-01_task-gel_physio.tsv.gz and .json into that directory: pressures, commanded\n"
      "      volume and triggers, one row a sample; what is missing is n/a\n"
      "  diastole export gel.run.h5 sweep.run.h5 --also gel.fit.json --also dicom/ --ro-crate gel-7\n"
      "      a folder with copies of all and ro-crate-metadata.json (JSON-LD): what each file is, when, by\n"
      "      whom and with what it was made, the rig's properties, specimen and notes");
  command->add_option("RUN", options->runs, "run files")->required();
  command->add_option("--bids", options->bids, "directory to write into; made if absent");
  command->add_option("--subject", options->subject, "BIDS subject label")->capture_default_str();
  command->add_option("--task", options->task, "BIDS task label; default: the run file's name");
  command->add_option("--ro-crate", options->crate, "directory of the crate; made if absent");
  command->add_option("--also", options->also,
                      "a file or folder that goes into the crate, too; may be repeated");
  command->add_option("--license", options->license,
                      "the crate's licence: an https address, or a name of SPDX as CC-BY-4.0");
  command->add_flag("--force", options->force, "replace files that exist");
  line.on_run(command, [options](const CommandOutput& out) { return export_runs(*options, out); });
}

}  // namespace diastole
