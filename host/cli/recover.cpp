#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/journal/journal_store.hpp"
#include "host/journal/parsed_journal.hpp"
#include "host/runfile/assemble.hpp"
#include "host/runfile/output_guard.hpp"
#include "host/runfile/writer.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

struct RecoverOptions {
  std::string journal;
  std::string output;
  bool force = false;
  bool list = false;
};

/// What `diastole recover --list` shows of one journal.
nlohmann::json describe(const StoredJournal& stored) {
  nlohmann::json summary{{"journal", stored.file.string()},
                         {"bytes", stored.bytes},
                         {"run_file", nullptr},
                         {"started_utc", nullptr},
                         {"complete", false}};
  if (stored.has_run_file) summary["run_file"] = run_file_beside(stored.file).string();
  try {
    const ParsedJournal parsed = parse_journal(JournalRecords(stored.file));
    summary["started_utc"] = parsed.begin.started_utc;
    summary["experiment"] = parsed.begin.experiment_file;
    summary["complete"] = parsed.closed;
  } catch (const InputError& error) {
    summary["problem"] = error.fault().problem;
  }
  return summary;
}

ExitCode list(const std::string& directory, const CommandOutput& out) {
  if (!std::filesystem::is_directory(directory)) {
    throw InputError(
        {directory, "", "is no directory", "Name the daemon's journal_dir; `diastole status` prints it."});
  }
  nlohmann::json journals = nlohmann::json::array();
  for (const StoredJournal& stored : stored_journals(directory))
    journals.push_back(describe(stored));
  if (out.json) {
    print_json({{"directory", directory}, {"journals", journals}});
    return ExitCode::done;
  }
  for (const nlohmann::json& journal : journals) {
    fmt::print(
        "{}\n  {}, {}, {:.1f} MB\n  {}\n", journal["journal"].get<std::string>(),
        journal["started_utc"].is_null() ? journal.value("problem", "")
                                         : journal["started_utc"].get<std::string>(),
        journal["complete"] == true ? "closed in order" : "broke off", 1e-6 * journal["bytes"].get<double>(),
        journal["run_file"].is_null()
            ? "no run file: diastole recover " + journal["journal"].get<std::string>() + " -o NAME.run.h5"
            : journal["run_file"].get<std::string>());
  }
  if (journals.empty()) fmt::print("{} holds no journal\n", directory);
  return ExitCode::done;
}

ExitCode report_nothing(const NothingRecorded& nothing, const CommandOutput& out) {
  fmt::print(stderr, "{}\n", nothing.what());
  if (out.json)
    print_json({{"run", nullptr}, {"recovered_samples", 0}, {"lost_samples", 0}, {"complete", false}});
  return ExitCode::negative;
}

ExitCode recover(const RecoverOptions& options, const CommandOutput& out) {
  if (options.list) return list(options.journal.empty() ? "journals" : options.journal, out);
  if (options.journal.empty() || options.output.empty()) {
    throw InputError({"", options.journal.empty() ? "JOURNAL" : "-o", "is missing",
                      "For example: diastole recover JOURNAL -o NAME.run.h5; --list shows the journals."});
  }
  check_output(options.output, options.force, {options.journal});
  AssembledRun assembled;
  try {
    const StreamedRun run = stream_run(JournalRecords(options.journal));
    const std::string remark = write_run(options.output, run);
    if (!remark.empty()) fmt::print(stderr, "{}\n", remark);
    assembled = run.assembled;
  } catch (const NothingRecorded& nothing) {
    return report_nothing(nothing, out);
  }
  const JournalDamage& damage = assembled.damage;
  const bool whole = assembled.ended_in_order && assembled.samples_missing == 0 && damage.records_lost == 0;
  const nlohmann::json document{{"run", options.output},
                                {"recovered_samples", assembled.samples_received},
                                {"lost_samples", assembled.samples_missing},
                                {"lost_records", damage.records_lost},
                                {"torn_tail_bytes", damage.torn_tail_bytes},
                                {"damaged_bytes", damage.damaged_bytes},
                                {"complete", assembled.ended_in_order}};
  print(out, document, [&] {
    fmt::print("{}: {} samples recovered, {} lost{}\n", options.output, assembled.samples_received,
               assembled.samples_missing,
               assembled.ended_in_order ? "" : "; the recording broke off before the run's end");
  });
  return whole ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_recover(CommandLine& line) {
  auto options = std::make_shared<RecoverOptions>();
  CLI::App* command = line.add(
      "recover", "rebuild a run file from its journal after a crash",
      "  diastole recover journals/5e0c....journal -o gel.run.h5\n"
      "  diastole recover --list /var/lib/diastole/journals\n"
      "      the daemon's journals, whether each is whole and has its run file\n"
      "Exit code 1: the run file is sound in itself, but something is lost; or the daemon had ended before\n"
      "the run began, and there is nothing to write.");
  command->add_option("JOURNAL", options->journal, "journal of the daemon; with --list their directory");
  command->add_option("-o,--output", options->output, "run file to write");
  command->add_flag("--list", options->list, "tell what journals there are");
  command->add_flag("--force", options->force, "replace the run file if it exists");
  line.on_run(command, [options](const CommandOutput& out) { return recover(*options, out); });
}

}  // namespace diastole
