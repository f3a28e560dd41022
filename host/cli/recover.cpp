#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/host_commands.hpp"
#include "host/runfile/assemble.hpp"
#include "host/runfile/writer.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

struct RecoverOptions {
  std::string journal;
  std::string output;
  bool force = false;
};

ExitCode recover(const RecoverOptions& options, const CommandOutput& out) {
  if (std::filesystem::exists(options.output) && !options.force) {
    throw InputError(
        {options.output, "", "exists already", "Choose another name, or --force to replace it."});
  }
  const JournalContents journal = read_journal(options.journal);
  const AssembledRun assembled = assemble_run(journal);
  write_run(options.output, assembled.run);
  const bool whole = assembled.ended_in_order && assembled.samples_missing == 0 && journal.records_lost == 0;
  if (out.json) {
    const nlohmann::json document{{"run", options.output},
                                  {"recovered_samples", assembled.samples_received},
                                  {"lost_samples", assembled.samples_missing},
                                  {"lost_records", journal.records_lost},
                                  {"torn_tail_bytes", journal.torn_tail_bytes},
                                  {"damaged_bytes", journal.damaged_bytes},
                                  {"complete", assembled.ended_in_order}};
    std::cout << document.dump(2) << '\n';
  } else {
    fmt::print("{}: {} samples recovered, {} lost{}\n", options.output, assembled.samples_received,
               assembled.samples_missing,
               assembled.ended_in_order ? "" : "; the recording broke off before the run's end");
  }
  return whole ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_recover(CommandLine& line) {
  auto options = std::make_shared<RecoverOptions>();
  CLI::App* command = line.add("recover", "rebuild a run file from its journal after a crash",
                               "  diastole recover journals/5e0c....journal -o gel.run.h5\n"
                               "Exit code 1: the run file is sound in itself, but something is lost.");
  command->add_option("JOURNAL", options->journal, "journal of the daemon")->required();
  command->add_option("-o,--output", options->output, "run file to write")->required();
  command->add_flag("--force", options->force, "replace the run file if it exists");
  line.on_run(command, [options](const CommandOutput& out) { return recover(*options, out); });
}

}  // namespace diastole
