#include "estimator/io/study_fingerprint.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/io/fingerprint.hpp"
#include "estimator/io/whole_file.hpp"

namespace diastole {

std::string study_fingerprint(const Study& study) {
  std::string content =
      fmt::format("mesh {} refine {}", fmt::join(mesh_of(study.specimen), ","), fmt::join(study.refine, ","));
  for (const StudyParameter& parameter : study.law.parameters) {
    content += fmt::format(" {} {:d} {}", parameter.name, static_cast<int>(parameter.smoothness.kind),
                           parameter.smoothness.step);
  }
  for (const std::filesystem::path& file : inputs_of(study)) {
    content += '\n';
    if (std::filesystem::is_regular_file(file)) content += read_whole_file(file);
  }
  return fingerprint_of(content);
}

}  // namespace diastole
