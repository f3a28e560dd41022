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
#include "estimator/report/embedded.hpp"
#include "estimator/report/fit_figures.hpp"
#include "estimator/report/table_figure.hpp"

namespace diastole {
namespace {

/// A page's drawing as a file of its own, with the page's colours.
std::string standalone(std::string svg) {
  const size_t inside = svg.find('>') + 1;
  svg.insert(inside, fmt::format("<style>{}</style><rect width=\"100%\" height=\"100%\" fill=\"white\"/>",
                                 report::embedded::page_css));
  svg.insert(svg.find("<svg") + 4, " xmlns=\"http://www.w3.org/2000/svg\"");
  return svg + "\n";
}

void draw(const std::string& file, const std::filesystem::path& folder) {
  const std::string text = read_whole_file(file);
  const auto write = [&](const char* name, const report::Figure& figure) {
    write_whole_file(folder / name, standalone(figure.svg));
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
