#include "estimator/cli/findings_text.hpp"

#include <fmt/format.h>

namespace diastole {

void print_findings(const std::vector<Finding>& findings, std::FILE* stream) {
  for (const Finding& finding : findings) {
    fmt::print(stream, "{}: {} [{}]\n  {}\n", describe(finding.severity), finding.what, finding.where,
               finding.remedy);
  }
}

}  // namespace diastole
