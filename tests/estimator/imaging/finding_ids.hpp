#pragma once

#include <string>
#include <vector>

#include "estimator/imaging/series/image_folder.hpp"

namespace diastole::test {

inline std::vector<std::string> ids_of(const std::vector<Finding>& findings) {
  std::vector<std::string> ids;
  for (const Finding& finding : findings)
    ids.push_back(finding.id);
  return ids;
}

inline std::vector<std::string> finding_ids(const imaging::ImageFolder& folder) {
  return ids_of(folder.problems);
}

}  // namespace diastole::test
