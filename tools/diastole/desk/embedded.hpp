#pragma once
// The desks' pages, which the build puts into the program (CMakeLists.txt of this folder).

#include <string_view>

namespace diastole::desk::embedded {

extern const std::string_view desk_css;
extern const std::string_view common_js;
extern const std::string_view tags_html;
extern const std::string_view tags_js;
extern const std::string_view guide_html;
extern const std::string_view guide_js;

}  // namespace diastole::desk::embedded
