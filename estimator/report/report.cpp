#include "estimator/report/report.hpp"

#include <fmt/format.h>

#include <vector>

#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/reconstruction_file.hpp"
#include "estimator/io/solution_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/shear/shear_fit.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::report {
namespace {

bool is_hdf5(std::string_view content) {
  return content.starts_with(std::string_view("\x89HDF\r\n\x1a\n", 8));
}

bool is_json_object(const std::string& content) {
  const size_t first = content.find_first_not_of(" \t\r\n");
  return first != std::string::npos && content[first] == '{';
}

std::string title_of(size_t estimates, size_t runs) {
  if (estimates == 0) return runs == 1 ? "A pump session" : "Pump sessions";
  return runs == 0 ? "Material stiffness" : "From a pump session to a material stiffness";
}

std::string explanation_title(const std::vector<explain::Explanation>& explanations) {
  if (explanations.size() > 1) return "Where models and measurements disagree";
  std::string name = std::filesystem::path(explanations[0].study).filename().string();
  name = name.substr(0, name.find(".study.toml"));
  return "Where model and measurement disagree" + (name.empty() ? "" : ": " + name);
}

}  // namespace

std::string make_report(std::span<const std::filesystem::path> files, const ReportOptions& options) {
  std::vector<FitRecord> fits;
  std::vector<SolutionRecord> solutions;
  std::vector<ReconstructionRecord> reconstructions;
  std::vector<explain::Explanation> explanations;
  std::vector<ShearTest> shear_tests;
  std::vector<SavedTable> tables;
  std::vector<runfile::RecordedRun> runs;
  for (const std::filesystem::path& file : files) {
    const std::string content = read_whole_file(file);
    if (is_hdf5(content)) {
      runs.push_back(runfile::read_run(file));
      continue;
    }
    if (is_shear_test(content)) {
      shear_tests.push_back(shear_test_from_text(content, file.string()));
      continue;
    }
    if (is_cells_file(content)) {
      tables.push_back(saved_table(content, file.string()));
      continue;
    }
    if (!is_json_object(content)) {
      throw InputError(
          {file.string(), "",
           "is neither a run file nor a fit result, a Monte Carlo table, an explanation, a reconstruction, a "
           "solution "
           "or a shear test",
           "Give files that `diastole run`, `diastole simulate`, `diastole fit -o`, `diastole explain -o`, "
           "`diastole montecarlo --cells`, "
           "`diastole reconstruct -o NAME.json` or `diastole solve -o NAME.json` wrote, or the CSV that "
           "`diastole shear` reads."});
    }
    if (explain::is_explanation(content)) {
      explanations.push_back(explain::explanation_from_json(content, file.string()));
      continue;
    }
    if (is_solution(content)) {
      solutions.push_back(solution_record_from_json(content, file.string()));
      continue;
    }
    if (is_reconstruction(content)) {
      reconstructions.push_back(reconstruction_record_from_json(content, file.string()));
      continue;
    }
    fits.push_back(fit_record_from_json(content, file.string()));
  }
  const bool no_estimate = fits.empty() && shear_tests.empty() && tables.empty() && runs.empty();
  Page page(!explanations.empty() ? explanation_title(explanations)
            : no_estimate ? (solutions.empty() && !reconstructions.empty() ? "Displacement from tagged images"
                                                                           : "Strain and stress under load")
                          : title_of(fits.size() + shear_tests.size() + tables.size(), runs.size()));
  for (const explain::Explanation& explanation : explanations)
    add_explanation(page, explanation);
  for (const FitRecord& fit : fits)
    add_fit(page, fit);
  for (const SavedTable& table : tables)
    add_montecarlo(page, table);
  for (const ReconstructionRecord& reconstruction : reconstructions)
    add_reconstruction(page, reconstruction);
  for (const SolutionRecord& solution : solutions)
    add_solution(page, solution);
  for (const ShearTest& test : shear_tests)
    add_shear(page, test, fit_shear(test));
  for (const runfile::RecordedRun& run : runs)
    add_run(page, run, options.frames);
  return page.html();
}

std::string make_report(const explain::Explanation& explanation) {
  Page page(explanation_title({explanation}));
  add_explanation(page, explanation);
  return page.html();
}

}  // namespace diastole::report
