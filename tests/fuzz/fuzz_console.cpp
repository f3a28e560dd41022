// Arbitrary bytes at the console's endpoint: an HTTP request, and behind it a message as the WebSocket hands it on. What
// is let in has shown a token, at a place of ours, from no other site's page; what is refused is told so in words; a
// message is taken or refused.
//
//   input: the request; in it 01 stands for the control token and 02 for the watch token.
//          What lies behind its header is the message.

#include <boost/asio/buffer.hpp>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "host/rpc/json_rpc.hpp"
#include "host/web/request.hpp"

namespace {

using namespace diastole;

void must(bool holds) {
  if (!holds) std::abort();
}

std::string token_of(const web::AccessPolicy& policy, ConsoleRole role) {
  const std::string url = policy.url(role, web::usual_port);
  return url.substr(url.find("token=") + 6);
}

void put_tokens(std::string& text, const std::string& control, const std::string& watch) {
  for (size_t at = 0; at < text.size(); ++at) {
    if (text[at] != 1 && text[at] != 2) continue;
    text.replace(at, 1, text[at] == 1 ? control : watch);
  }
}

std::string lower(std::string text) {
  for (char& each : text)
    if (each >= 'A' && each <= 'Z') each = static_cast<char>(each + 'a' - 'A');
  return text;
}

std::string value_of(const web::Request& request, boost::beast::http::field field) {
  return lower(std::string(request[field]));
}

/// Independent of AccessPolicy's own check, by how such places are written: localhost, 127.x.x.x, [::1], 0:0:...:1.
bool is_ours(const std::string& host) {
  if (host == "localhost" || host.starts_with("localhost:")) return true;
  const std::string address = host.substr(0, host.rfind(':'));
  return (host.starts_with("127.") && address.find_first_not_of("0123456789.") == std::string::npos) ||
         host.starts_with('[') || host.starts_with(':') || host.starts_with('0');
}

void check(const web::AccessPolicy& policy, const web::Request& request, const std::string& control,
           const std::string& watch) {
  using boost::beast::http::field;
  const web::Verdict verdict = web::judge(policy, request, 0, 16);
  must(1 == int(verdict.refusal.has_value()) + int(verdict.page != nullptr) +
                int(verdict.asked_role.has_value()) + int(verdict.let_in_as.has_value()));
  if (verdict.refusal) {
    must(verdict.refusal->status >= 400 && verdict.refusal->status < 600 &&
         !verdict.refusal->sentence.empty());
    return;
  }
  const std::string host = value_of(request, field::host);
  must(is_ours(host));
  if (request.find(field::origin) != request.end()) {
    const std::string origin = value_of(request, field::origin);
    must(origin == "http://" + host || origin == "https://" + host);
  }
  if (verdict.page != nullptr) return;
  const auto role = verdict.asked_role ? verdict.asked_role : verdict.let_in_as;
  const std::string shown =
      value_of(request, field::authorization) + value_of(request, field::sec_websocket_protocol);
  must(shown.find(*role == ConsoleRole::control ? control : watch) != std::string::npos);
}

void take_message(const std::string& message) {
  nlohmann::json id;
  try {
    must(rpc::parse_request(message, id).params.is_object());
  } catch (const rpc::Error&) {
    must(!rpc::error_line(id, std::current_exception()).empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const web::AccessPolicy policy(web::parse_console_address("", "", ""), "rigpc");
  static const std::string control = token_of(policy, ConsoleRole::control);
  static const std::string watch = token_of(policy, ConsoleRole::watch);
  std::string bytes(reinterpret_cast<const char*>(data), size);
  put_tokens(bytes, control, watch);
  web::RequestParser parser;
  web::set_bounds(parser);
  boost::beast::error_code error;
  const size_t parsed = parser.put(boost::asio::buffer(bytes), error);
  if (error) {
    must(!web::no_request(error).sentence.empty());
  } else if (parser.is_header_done()) {
    check(policy, parser.get(), control, watch);
    take_message(bytes.substr(parsed));
  }
  return 0;
}
