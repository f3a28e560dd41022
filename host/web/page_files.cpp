#include "host/web/page_files.hpp"

#include <algorithm>
#include <array>

#include "host/web/embedded.hpp"

namespace diastole::web {
namespace {

constexpr std::string_view html = "text/html; charset=utf-8";
constexpr std::string_view css = "text/css; charset=utf-8";
constexpr std::string_view script = "text/javascript; charset=utf-8";
constexpr std::string_view text = "text/plain; charset=utf-8";
constexpr std::string_view woff2 = "font/woff2";
constexpr std::string_view svg = "image/svg+xml";

}  // namespace

std::span<const PageFile> page_files() {
  static const std::array files{
      PageFile{"/", html, embedded::index_html},
      PageFile{"/console.css", css, embedded::console_css},
      PageFile{"/console.js", script, embedded::console_js},
      PageFile{"/daemon.js", script, embedded::daemon_js},
      PageFile{"/trace.js", script, embedded::trace_js},
      PageFile{"/dialogs.js", script, embedded::dialogs_js},
      PageFile{"/icon.svg", svg, embedded::icon_svg},
      PageFile{"/inter.woff2", woff2, embedded::inter_woff2},
      PageFile{"/inter-licence.txt", text, embedded::inter_licence},
      PageFile{"/uplot.js", script, embedded::uplot_js},
      PageFile{"/uplot.css", css, embedded::uplot_css},
      PageFile{"/uplot-licence.txt", text, embedded::uplot_licence},
  };
  return files;
}

const PageFile* find_page_file(std::string_view path) {
  const auto files = page_files();
  const auto found =
      std::find_if(files.begin(), files.end(), [&](const PageFile& file) { return file.path == path; });
  return found == files.end() ? nullptr : &*found;
}

}  // namespace diastole::web
