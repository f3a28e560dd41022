#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/journal/part_file.hpp"
#include "host/runfile/bids_export.hpp"
#include "host/runfile/output_guard.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  fs::path run;
  fs::path directory;
  std::string subject = "01";
  std::string task;
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

ExitCode export_run(const ExportOptions& options, const CommandOutput& out) {
  const std::string task = options.task.empty() ? task_of(options.run) : label("--task", options.task);
  const fs::path stem =
      options.directory / fmt::format("sub-{}_task-{}_physio", label("--subject", options.subject), task);
  const fs::path table = stem.string() + ".tsv.gz", description = stem.string() + ".json";
  const runfile::RecordedRun run = runfile::read_run(options.run);
  if (run.pressure.time_s.size() < 2) {
    throw InputError({run.file, "dataset /pressure/time_s", "holds fewer than two samples",
                      "There is nothing to export."});
  }
  std::error_code error;
  fs::create_directories(options.directory, error);
  require_new_file(table, options.force);
  require_new_file(description, options.force);
  const BidsRecording recording = bids_recording(run);
  write_text_file(table, gzip(recording.table));
  write_text_file(description, recording.description.dump(2) + "\n");
  print(out,
        {{"run", options.run.string()},
         {"table", table.string()},
         {"description", description.string()},
         {"columns", recording.description.at("Columns")},
         {"rows", run.pressure.time_s.size()}},
        [&] { fmt::print("{}\n{}\n", table.string(), description.string()); });
  return ExitCode::done;
}

}  // namespace

void add_export(CommandLine& line) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* command = line.add(
      "export", "a run as a BIDS physiological recording",
      "  diastole export gel.run.h5 --bids study/sub-01/func --subject 01 --task gel\n"
      "      writes sub-01_task-gel_physio.tsv.gz and .json into that directory: pressures, commanded\n"
      "      volume and triggers, one row a sample; what is missing is n/a");
  command->add_option("RUN", options->run, "run file")->required();
  command->add_option("--bids", options->directory, "directory to write into; made if absent")->required();
  command->add_option("--subject", options->subject, "BIDS subject label")->capture_default_str();
  command->add_option("--task", options->task, "BIDS task label; default: the run file's name");
  command->add_flag("--force", options->force, "replace files that exist");
  line.on_run(command, [options](const CommandOutput& out) { return export_run(*options, out); });
}

}  // namespace diastole
