#include "host/web/request.hpp"

#include <fmt/format.h>

#include <boost/beast/websocket/rfc6455.hpp>

namespace diastole::web {
namespace {

namespace http = boost::beast::http;

std::string_view view(boost::beast::string_view text) { return {text.data(), text.size()}; }

std::optional<ConsoleRole> shown_role(const Door& door, const Request& request) {
  return door.role_of(token_in(view(request[http::field::authorization]),
                               view(request[http::field::sec_websocket_protocol])));
}

Verdict refused(int status, std::string sentence) {
  return {.refusal = Refusal{status, std::move(sentence)}};
}

Verdict judge_upgrade(const Door& door, const Request& request, size_t consoles_open, size_t most_consoles) {
  if (!boost::beast::websocket::is_upgrade(request)) return refused(426, "At /rpc a WebSocket is spoken.");
  const auto role = shown_role(door, request);
  if (!role) return {.refusal = Door::wrong_token()};
  if (consoles_open >= most_consoles)
    return refused(503, fmt::format("{} consoles are open already; close one.", most_consoles));
  return {.let_in_as = role};
}

}  // namespace

void set_bounds(RequestParser& parser) {
  parser.header_limit(most_header_bytes);
  parser.body_limit(uint64_t{0});
}

Refusal no_request(const boost::beast::error_code& error) {
  return {400, "This is not a request that the console understands: " + error.message() + "."};
}

Verdict judge(const Door& door, const Request& request, size_t consoles_open, size_t most_consoles) {
  const auto origin = request.find(http::field::origin);
  if (const auto refusal =
          door.check_place(view(request[http::field::host]),
                           origin == request.end() ? std::nullopt : std::optional(view(origin->value()))))
    return {.refusal = refusal};
  if (request.method() != http::verb::get) return refused(405, "Only GET is understood here.");
  const std::string_view all = view(request.target());
  const std::string_view target = all.substr(0, all.find('?'));
  if (target == "/rpc") return judge_upgrade(door, request, consoles_open, most_consoles);
  if (target == "/role") {
    const auto role = shown_role(door, request);
    return role ? Verdict{.asked_role = role} : Verdict{.refusal = Door::wrong_token()};
  }
  const PageFile* file = find_page_file(target);
  return file != nullptr ? Verdict{.page = file}
                         : refused(404, "There is no such page here. The console is at /.");
}

}  // namespace diastole::web
