#pragma once

#include <string>
#include <vector>

#include "estimator/imaging/series/image_folder.hpp"

namespace diastole::test {

inline std::vector<std::string> finding_ids(const imaging::ImageFolder& folder) {
  std::vector<std::string> ids;
  for (const Finding& finding : folder.problems)
    ids.push_back(finding.id);
  return ids;
}

}  // namespace diastole::test
