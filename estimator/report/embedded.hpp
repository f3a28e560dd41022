#pragma once
// Files that the build puts into the program (CMakeLists.txt of this folder).

#include <string_view>

namespace diastole::report::embedded {

extern const std::string_view page_css;
extern const std::string_view page_js;
extern const std::string_view cine_css;
extern const std::string_view cine_js;
extern const std::string_view uplot_js;
extern const std::string_view uplot_css;
extern const std::string_view uplot_licence;

}  // namespace diastole::report::embedded
