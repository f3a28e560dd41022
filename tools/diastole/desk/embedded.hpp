#pragma once
// The desk's page, which the build puts into the program (CMakeLists.txt of this folder).

#include <string_view>

namespace diastole::desk::embedded {

extern const std::string_view desk_html;
extern const std::string_view desk_css;
extern const std::string_view desk_js;

}  // namespace diastole::desk::embedded
