#pragma once
// The files of the console's page; the build puts them into the program (CMakeLists.txt of this folder).

#include <span>
#include <string_view>

namespace diastole::web {

struct PageFile {
  std::string_view path;  ///< as in a request: "/console.css"
  std::string_view type;  ///< as in Content-Type
  std::string_view text;
};

std::span<const PageFile> page_files();
/// Null if there is none at this path.
const PageFile* find_page_file(std::string_view path);

}  // namespace diastole::web
