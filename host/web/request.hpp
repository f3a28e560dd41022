#pragma once
// What becomes of an HTTP request at the console: the page's files, the role of a token, the way to the WebSocket, or a
// refusal. A request in, a verdict out; no input or output.

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "host/web/access_policy.hpp"

namespace diastole::web {

/// The files of the page; the build puts them into the program (CMakeLists.txt of this folder).
struct PageFile {
  std::string_view path;  ///< as in a request: "/console.css"
  std::string_view type;  ///< as in Content-Type
  std::string_view text;
};

std::span<const PageFile> page_files();
/// Null if there is none at this path.
const PageFile* find_page_file(std::string_view path);

using Request = boost::beast::http::request<boost::beast::http::empty_body>;
using RequestParser = boost::beast::http::request_parser<boost::beast::http::empty_body>;

inline constexpr uint32_t most_header_bytes = 8192;

/// Sets the bounds of a request: most_header_bytes, no body.
void set_bounds(RequestParser& parser);

/// Of every answer: nothing is kept, and a page has what is of its own origin alone.
void set_page_headers(boost::beast::http::fields& response);

/// What cannot be parsed.
Refusal no_request(const boost::beast::error_code& error);

/// One of these.
struct Verdict {
  std::optional<Refusal> refusal{};         ///< 401: the token is not valid
  const PageFile* page = nullptr;           ///< to be sent
  std::optional<ConsoleRole> asked_role{};  ///< the answer to /role
  std::optional<ConsoleRole> let_in_as{};   ///< the WebSocket is to be opened
};

/// `consoles_open`: of at most `most_consoles`.
Verdict judge(const AccessPolicy& policy, const Request& request, size_t consoles_open, size_t most_consoles);

}  // namespace diastole::web
