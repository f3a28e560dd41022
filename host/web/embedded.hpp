#pragma once
// Files that the build puts into the program (CMakeLists.txt of this folder).

#include <string_view>

namespace diastole::web::embedded {

extern const std::string_view index_html;
extern const std::string_view console_css;
extern const std::string_view console_js;
extern const std::string_view daemon_js;
extern const std::string_view trace_js;
extern const std::string_view dialogs_js;
extern const std::string_view icon_svg;
extern const std::string_view inter_woff2;
extern const std::string_view inter_licence;
extern const std::string_view uplot_js;
extern const std::string_view uplot_css;
extern const std::string_view uplot_licence;

}  // namespace diastole::web::embedded
