#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/diastole/desk/desk_server.hpp"

namespace diastole {
namespace {

struct DeskArguments {
  imaging::TrackRequest request;
  std::optional<std::filesystem::path> tags;
  uint16_t port = 0;
  bool no_browser = false;
  bool force = false;
};

/// In a session with a screen; without one, or without xdg-open, the address is what there is.
void open_browser(const std::string& url) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string program = "xdg-open", address = url;
  std::array<char*, 3> arguments{program.data(), address.data(), nullptr};
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  (void)::posix_spawnp(&child, program.c_str(), &quiet, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&quiet);
}

ExitCode run_desk(const DeskArguments& arguments, const CommandOutput& out) {
  if (arguments.tags) {
    std::vector<std::filesystem::path> inputs = {imaging::edits_file(arguments.request)};
    if (arguments.request.pose) inputs.push_back(*arguments.request.pose);
    require_output({*arguments.tags, inputs, imaging::tags_file_mark, arguments.force});
  }
  desk::DeskSession session(arguments.request, arguments.tags);
  desk::DeskServer server(session, arguments.port);
  const std::string url = server.url(), file = session.edits_file().string();
  if (out.json) {
    std::cout << json_text(nlohmann::json{{"url", url}, {"edits", file}}) << std::endl;
  } else {
    fmt::print("The desk: {}\nChoices go to {}\nCtrl-C ends it; nothing is lost.\n", url, file);
    std::fflush(stdout);
  }
  if (!arguments.no_browser) open_browser(url);
  server.run();
  return ExitCode::done;
}

}  // namespace

void add_desk(CommandLine& line) {
  auto arguments = std::make_shared<DeskArguments>();
  CLI::App* command = line.add(
      "desk", "look at and correct tracking and contours in a browser",
      "  diastole desk dicom/\n"
      "  diastole desk dicom/ -o gel.tags.csv\n"
      "  diastole desk dicom/ --port 8610 --no-browser     # over ssh -L 8610:127.0.0.1:8610\n"
      "Drag lines, mask regions, draw the wall's contours, undo, track again. Each choice is a line of "
      "FOLDER.edits.jsonl at once,\n"
      "which `diastole track` and `fit` replay: nothing is done here that a file could not say. Only this "
      "machine "
      "is answered, and\n"
      "only with the address that is printed. docs/imaging.md says more.");
  DeskArguments& a = *arguments;
  command->add_option("FOLDER", a.request.folder, "the folder with the scanner's files")->required();
  command->add_option("--edits", a.request.edits,
                      "the file of choices [FOLDER.edits.jsonl beside the folder]");
  command->add_option("-o,--output", a.tags, "the tag points, written after each tracking (*.tags.csv)");
  command->add_option("--pose", a.request.pose,
                      "where the specimen's frame lies in patient coordinates (*.pose.toml)");
  command->add_option("--coords", a.request.coordinates, "coordinates of the points")
      ->check(CLI::IsMember({"auto", "specimen", "patient"}))
      ->capture_default_str();
  command->add_option("--port", a.port, "of 127.0.0.1 [any free one]")->check(CLI::Range(0, 65535));
  command->add_flag("--no-browser", a.no_browser, "print the address only");
  command->add_flag("--force", a.force, "replace an output file that is none of track's");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_desk(*arguments, out); });
}

}  // namespace diastole
