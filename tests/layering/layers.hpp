#pragma once
// The direction of dependence between the folders of this project, checked on the #include lines.
//
//   protocol ←── firmware/core ←── firmware/boards
//       ↑  ↑
//    host  estimator            host and estimator never see each other; tools and tests may use all of them
//
// The most specific folder of a file decides; a folder may always include itself.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace diastole::layering {

struct Rule {
  std::string_view folder;
  std::vector<std::string_view> may_include;
};

/// A line that includes a header of this project.
struct Include {
  std::string file;  ///< relative to the root
  int line;
  std::string included;
};

/// The project's rules, most specific folder first.
const std::vector<Rule>& rules();

/// Every include of a project header under `root` that no rule allows. Only the source folders are read.
std::vector<Include> violations(const std::filesystem::path& root);

/// Every include of another folder from which, directly or through others, the way leads back.
std::vector<Include> circles(const std::filesystem::path& root);

}  // namespace diastole::layering
