#include "host/web/request.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/beast/websocket/rfc6455.hpp>

#include "host/web/embedded.hpp"

namespace diastole::web {
namespace {

constexpr std::string_view html = "text/html; charset=utf-8";
constexpr std::string_view css = "text/css; charset=utf-8";
constexpr std::string_view script = "text/javascript; charset=utf-8";
constexpr std::string_view text = "text/plain; charset=utf-8";
constexpr std::string_view woff2 = "font/woff2";
constexpr std::string_view svg = "image/svg+xml";

namespace http = boost::beast::http;

std::string_view view(boost::beast::string_view field) { return {field.data(), field.size()}; }

std::optional<ConsoleRole> shown_role(const AccessPolicy& policy, const Request& request) {
  return policy.role_of(token_in(view(request[http::field::authorization]),
                                 view(request[http::field::sec_websocket_protocol])));
}

Verdict refused(int status, std::string sentence) {
  return {.refusal = Refusal{status, std::move(sentence)}};
}

Verdict judge_upgrade(const AccessPolicy& policy, const Request& request, size_t consoles_open,
                      size_t most_consoles) {
  if (!boost::beast::websocket::is_upgrade(request)) return refused(426, "At /rpc a WebSocket is spoken.");
  const auto role = shown_role(policy, request);
  if (!role) return {.refusal = AccessPolicy::wrong_token()};
  if (consoles_open >= most_consoles)
    return refused(503, fmt::format("{} consoles are open already; close one.", most_consoles));
  return {.let_in_as = role};
}

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
  const auto found = std::ranges::find(files, path, &PageFile::path);
  return found == files.end() ? nullptr : &*found;
}

void set_page_headers(http::fields& response) {
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Content-Security-Policy",
               "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'; "
               "font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
}

void set_bounds(RequestParser& parser) {
  parser.header_limit(most_header_bytes);
  parser.body_limit(uint64_t{0});
}

Refusal no_request(const boost::beast::error_code& error) {
  return {400, "This is not a request that the console understands: " + error.message() + "."};
}

Verdict judge(const AccessPolicy& policy, const Request& request, size_t consoles_open,
              size_t most_consoles) {
  const auto origin = request.find(http::field::origin);
  if (const auto refusal =
          policy.check_place(view(request[http::field::host]),
                             origin == request.end() ? std::nullopt : std::optional(view(origin->value()))))
    return {.refusal = refusal};
  if (request.method() != http::verb::get) return refused(405, "Only GET is understood here.");
  const std::string_view all = view(request.target());
  const std::string_view target = all.substr(0, all.find('?'));
  if (target == "/rpc") return judge_upgrade(policy, request, consoles_open, most_consoles);
  if (target == "/role") {
    const auto role = shown_role(policy, request);
    return role ? Verdict{.asked_role = role} : Verdict{.refusal = AccessPolicy::wrong_token()};
  }
  const PageFile* file = find_page_file(target);
  return file != nullptr ? Verdict{.page = file}
                         : refused(404, "There is no such page here. The console is at /.");
}

}  // namespace diastole::web
