// The pictures of docs/estimation.md, from results that `diastole fit -o` and `diastole montecarlo --cells` left:
//
//   estimation_figures FILE ... FOLDER     map.svg of a regional fit, profile.svg of one with --profile, table.svg of a
//                                          table of cells

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "estimator/io/whole_file.hpp"
#include "estimator/report/fit_figures.hpp"

namespace diastole {
namespace {

void draw(const std::string& file, const std::filesystem::path& folder) {
  const std::string text = read_whole_file(file);
  const auto write = [&](const char* name, const report::Figure& figure) {
    write_whole_file(folder / name, report::standalone(figure.svg, figure.caption));
    fmt::print("{}: {}\n", (folder / name).string(), figure.caption);
  };
  if (is_cells_file(text)) {
    write("table.svg", report::table_figure(saved_table(text, file), 0));
    return;
  }
  const FitRecord fit = fit_record_from_json(text, file);
  for (const FittedParameter& parameter : fit.parameters) {
    if (!parameter.elements.empty()) write("map.svg", report::regional_figures(fit, parameter).front());
  }
  const FittedParameter& last = fit.parameters.back();
  if (last.profile && last.profile->value.size() > 2) write("profile.svg", report::profile_figure(last));
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs(
        "estimation_figures: give results of `diastole fit -o` and `diastole montecarlo --cells`, and a "
        "folder\n",
        stderr);
    return 2;
  }
  try {
    for (int i = 1; i + 1 < argc; ++i)
      diastole::draw(argv[i], argv[argc - 1]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "estimation_figures: {}\n", error.what());
    return 2;
  }
}
