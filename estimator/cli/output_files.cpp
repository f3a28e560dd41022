#include "estimator/cli/output_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

void OutputFiles::add_options(CLI::App& command, const std::string& kinds_in_words) {
  command.add_option("-o,--output", files, kinds_in_words + "; may be repeated")->allow_extra_args(false);
  command.add_flag("--force", force, "replace an output file that is no earlier result");
}

void OutputFiles::require(const std::vector<std::filesystem::path>& inputs, std::span<const OutputKind> kinds,
                          const std::string& problem, const std::string& remedy) const {
  for (const std::filesystem::path& file : files) {
    const auto kind = std::ranges::find(kinds, file.extension().string(), &OutputKind::ending);
    if (kind == kinds.end()) throw InputError({file.string(), "", problem, remedy});
    require_output({file, inputs, kind->mark, force});
  }
}

void print_findings(const std::vector<Finding>& findings, std::FILE* stream) {
  for (const Finding& finding : findings) {
    const std::string place = finding.where.empty() ? "" : fmt::format(" [{}]", finding.where);
    fmt::print(stream, "{}: {}{}\n  {}\n", describe(finding.severity), finding.what, place, finding.remedy);
  }
}

}  // namespace diastole
