#include <fmt/format.h>

#include <fmt/chrono.h>
#include <ctime>
#include <filesystem>
#include <memory>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/cli/session_facts.hpp"
#include "protocol/runfile/note_writer.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
namespace {

struct NoteOptions {
  std::filesystem::path run;
  std::string text;
  std::string author;
};

ExitCode note(const NoteOptions& options, const CommandOutput& out) {
  if (!options.text.empty()) {
    runfile::append_note(options.run,
                         {fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))),
                          options.author.empty() ? own_user_name() : options.author, options.text});
  }
  const runfile::RecordedRun run = runfile::open_run(options.run).run;  // refuses what is no run
  const runfile::Session session = runfile::read_session(options.run);
  const nlohmann::json document{{"run", run.file}, {"session", session_json(session)}};
  print(out, document, [&] {
    const std::string words = session_words(session);
    fmt::print("{}\n{}", run.file, words.empty() ? "  nothing was noted\n" : words);
  });
  return ExitCode::done;
}

}  // namespace

void add_note(CommandLine& line) {
  auto options = std::make_shared<NoteOptions>();
  CLI::App* command = line.add(
      "note", "write a note into a run file, or show its notes",
      "  diastole note gel.run.h5 \"the hose was warm when we began\"\n"
      "      added with the time and your name; what was recorded, and earlier notes, stay as they are\n"
      "  diastole note gel.run.h5\n"
      "      what is known of the session, and all notes");
  command->add_option("RUN", options->run, "run file")->required();
  command->add_option("TEXT", options->text, "the note");
  command->add_option("--author", options->author, "who says so; default: your login name");
  line.on_run(command, [options](const CommandOutput& out) { return note(*options, out); });
}

}  // namespace diastole
