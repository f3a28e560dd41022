#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/report.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

struct ReportArguments {
  std::vector<std::filesystem::path> files;
  std::filesystem::path page;
  size_t frames = 16;
  bool force = false;
};

ExitCode run_report(const ReportArguments& arguments, const CommandOutput& out) {
  require_output({arguments.page, arguments.files, report::page_mark, arguments.force});
  const std::string html = report::make_report(arguments.files, arguments.frames);
  write_whole_file(arguments.page, html);
  if (out.json) {
    nlohmann::ordered_json json = {{"page", arguments.page.string()}, {"bytes", html.size()}};
    for (const auto& file : arguments.files)
      json["files"].push_back(file.string());
    std::cout << json_text(json, 1) << '\n';
  } else {
    std::cout << "The report is in " << arguments.page.string() << '\n';
  }
  return ExitCode::done;
}

}  // namespace

void add_report(CommandLine& line) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command =
      line.add("report", "a self-contained page with plots for runs, fits, solutions and explanations",
               "  diastole report gel.run.h5 -o session.html\n"
               "  diastole report gel.run.h5 fit.json -o gel.html");
  command
      ->add_option("FILE", arguments->files,
                   "run files, fit results (one of images opens with them), records of tracked images, "
                   "explanations, solutions and shear tests, recognised by "
                   "their content")
      ->required();
  command->add_option("-o,--output", arguments->page, "the HTML page to write")->required();
  command->add_flag("--force", arguments->force, "replace an output file that is no report");
  command->add_option("--frames", arguments->frames, "image frames of a cycle")
      ->check(number_between(1, 1000))
      ->capture_default_str();
  line.on_run(command, [arguments](const CommandOutput& out) { return run_report(*arguments, out); });
}

}  // namespace diastole
