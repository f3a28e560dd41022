#include <fmt/format.h>

#include "estimator/report/sections.hpp"

namespace diastole::report {

void add_findings(Page& page, const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    const std::string text = fmt::format("{} {} ({})", finding.what, finding.remedy, finding.where);
    if (finding.severity == Severity::note) {
      page.paragraph(text);
    } else {
      page.warning(text);
    }
  }
}

}  // namespace diastole::report
