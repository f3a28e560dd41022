#pragma once
// Recordings and images of independent programs. A small part stands in tests/data; the whole sets, where they are at
// hand, beside the source tree.

#include <filesystem>
#include <string_view>

namespace diastole::test {

/// The file or folder `name` ("rig/case-009") of tests/data or, if it is not there, of shared/data beside the tree; neither need exist.
inline std::filesystem::path recorded(std::string_view name) {
  const std::filesystem::path source = DIASTOLE_SOURCE_DIR;
  const std::filesystem::path in_tree = source / "tests/data" / name;
  return std::filesystem::exists(in_tree) ? in_tree : source.parent_path() / "shared/data" / name;
}

}  // namespace diastole::test
