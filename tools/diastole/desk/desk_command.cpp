#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/diastole/desk/desk_server.hpp"
#include "tools/diastole/desk/guide_desk.hpp"
#include "tools/diastole/desk/tag_desk.hpp"

namespace diastole {
namespace {

struct DeskArguments {
  imaging::TrackRequest request;
  std::optional<std::filesystem::path> tags, guide;
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

/// Serves until Ctrl-C. `file`: what is written at each choice, under `name` in JSON.
ExitCode serve(desk::DeskPages& pages, const DeskArguments& arguments, const std::string& name,
               const std::filesystem::path& file, const CommandOutput& out) {
  desk::DeskServer server(pages, arguments.port);
  const std::string url = server.url();
  if (out.json) {
    std::cout << json_text(nlohmann::json{{"url", url}, {name, file.string()}}) << std::endl;
  } else {
    fmt::print("The desk: {}\nWhat is done there goes to {}\nCtrl-C ends it; nothing is lost.\n", url,
               file.string());
    std::fflush(stdout);
  }
  if (!arguments.no_browser) open_browser(url);
  server.run();
  return ExitCode::done;
}

/// The walls of cines, or tags: what is asked for, else what the folder has.
bool is_for_guide_points(const DeskArguments& arguments, const imaging::ImageFolder& folder) {
  if (arguments.guide) return true;
  const imaging::TrackRequest& request = arguments.request;
  if (arguments.tags || request.edits || request.pose) return false;
  const auto has = [&](imaging::SeriesKind kind) {
    return std::ranges::any_of(folder.series, [&](const auto& series) { return series.kind == kind; });
  };
  return has(imaging::SeriesKind::cine) && !has(imaging::SeriesKind::tagged_cine);
}

ExitCode run_desk(const DeskArguments& arguments, const CommandOutput& out) {
  const imaging::ImageFolder folder = imaging::read_image_folder(arguments.request.folder);
  if (is_for_guide_points(arguments, folder)) {
    const std::filesystem::path guide =
        arguments.guide.value_or(imaging::beside(arguments.request.folder, ".guide.csv"));
    std::error_code error;
    if (!std::filesystem::exists(guide, error)) require_output({guide, {}, "", false});
    desk::GuideDesk pages(folder, guide);
    return serve(pages, arguments, "guide", guide, out);
  }
  if (arguments.tags) {
    std::vector<std::filesystem::path> inputs = {imaging::edits_file(arguments.request)};
    if (arguments.request.pose) inputs.push_back(*arguments.request.pose);
    require_output({*arguments.tags, inputs, imaging::tags_file_mark, arguments.force});
  }
  desk::TagDesk pages(folder, arguments.request, arguments.tags);
  return serve(pages, arguments, "edits", pages.edits_file(), out);
}

}  // namespace

void add_desk(CommandLine& line) {
  auto arguments = std::make_shared<DeskArguments>();
  CLI::App* command = line.add(
      "desk", "look at and correct tracking, contours and guide points in a browser",
      "  diastole desk dicom/\n"
      "  diastole desk dicom/ -o gel.tags.csv\n"
      "  diastole desk dicom/ --port 8610 --no-browser     # over ssh -L 8610:127.0.0.1:8610\n"
      "  diastole desk cines/ --guide heart.guide.csv\n"
      "Tagged images: drag lines, mask regions, draw the wall's contours, undo, track again. Each choice is\n"
      "a line of FOLDER.edits.jsonl at once, which `diastole track` and `fit` replay.\n"
      "Cines: set, move and remove guide points on a ventricle's walls, and see the ventricle that is "
      "fitted\n"
      "to them. They are in FOLDER.guide.csv at once, which `diastole lv` takes.\n"
      "Nothing is done here that a file could not say. Only this machine is answered, and only with the\n"
      "address that is printed. docs/imaging.md and docs/lv.md say more.");
  DeskArguments& a = *arguments;
  command->add_option("FOLDER", a.request.folder, "the folder with the scanner's files")->required();
  auto* guide = command->add_option("--guide", a.guide,
                                    "guide points on cines, which are found where there is no such file "
                                    "[FOLDER.guide.csv beside a folder that has cines and no tags]");
  command
      ->add_option("--edits", a.request.edits,
                   "the file of choices about tags [FOLDER.edits.jsonl beside the folder]")
      ->excludes(guide);
  command->add_option("-o,--output", a.tags, "the tag points, written after each tracking (*.tags.csv)")
      ->excludes(guide);
  command
      ->add_option("--pose", a.request.pose,
                   "where the specimen's frame lies in patient coordinates (*.pose.toml)")
      ->excludes(guide);
  command->add_option("--coords", a.request.coordinates, "coordinates of the tag points")
      ->check(CLI::IsMember({"auto", "specimen", "patient"}))
      ->capture_default_str()
      ->excludes(guide);
  command->add_option("--port", a.port, "of 127.0.0.1 [any free one]")->check(number_between(0, 65535));
  command->add_flag("--no-browser", a.no_browser, "print the address only");
  command->add_flag("--force", a.force, "replace an output file that is none of track's");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_desk(*arguments, out); });
}

}  // namespace diastole
