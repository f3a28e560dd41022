#include "host/web/access_policy.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::web {
namespace {

namespace ip = boost::asio::ip;

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return result;
}

struct NameAndPort {
  std::string_view name;  // brackets of an IPv6 address removed
  std::string_view port;
};

NameAndPort split(std::string_view text) {
  if (text.starts_with('[')) {
    const size_t end = text.find(']');
    if (end == std::string_view::npos) return {text, {}};
    const std::string_view rest = text.substr(end + 1);
    return {text.substr(1, end - 1), rest.starts_with(':') ? rest.substr(1) : rest};
  }
  const size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return {text, {}};
  return {text.substr(0, colon), text.substr(colon + 1)};
}

std::optional<ip::address> parsed_address(std::string_view text) {
  boost::system::error_code error;
  const ip::address address = ip::make_address(std::string(text), error);
  return error ? std::nullopt : std::optional(address);
}

}  // namespace

ConsoleAddress parse_console_address(const std::string& text, const std::string& file,
                                     const std::string& place) {
  ConsoleAddress result{ip::address_v4::loopback(), usual_port};
  if (text.empty()) return result;
  const auto refuse = [&]() -> InputError {
    return InputError({file, place, fmt::format("\"{}\" is no [ADDRESS:]PORT", text),
                       "For instance 8600, or 192.168.1.5:8600 to be reached over the network."});
  };
  std::string_view port = text;
  if (text.find(':') != std::string::npos) {
    const NameAndPort parts = split(text);
    const auto address = parsed_address(parts.name);
    if (!address) throw refuse();
    result.address = *address;
    port = parts.port;
  }
  const auto number = parse_number<uint16_t>(port);
  if (!number) throw refuse();
  result.port = *number;
  return result;
}

AccessPolicy::AccessPolicy(const ConsoleAddress& address, std::string machine)
    : address_(address), machine_(lower(machine)), control_token_(new_token()), watch_token_(new_token()) {}

bool AccessPolicy::is_own(std::string_view name) const {
  const std::string own = lower(name);
  if (own == "localhost") return true;
  if (const auto address = parsed_address(own))
    return reaches_beyond_this_machine() || address->is_loopback();
  if (!reaches_beyond_this_machine() || machine_.empty()) return false;
  return own == machine_ || own == machine_.substr(0, machine_.find('.'));
}

std::optional<Refusal> AccessPolicy::check_place(std::string_view host,
                                                 std::optional<std::string_view> origin) const {
  if (!is_own(split(host).name)) {
    return Refusal{
        403,
        "This page answers to an address (http://127.0.0.1:8600) or this machine's own name only, not to "
        "whatever name points to it. Open the address that was printed."};
  }
  const std::string own = lower(host);
  if (origin && lower(*origin) != "http://" + own && lower(*origin) != "https://" + own) {
    return Refusal{403, "A page of another site asked, and was refused."};
  }
  return std::nullopt;
}

std::optional<ConsoleRole> AccessPolicy::role_of(std::string_view token) const {
  const bool controls = same_secret(token, control_token_);
  const bool watches = same_secret(token, watch_token_);
  if (controls) return ConsoleRole::control;
  return watches ? std::optional(ConsoleRole::watch) : std::nullopt;
}

Refusal AccessPolicy::wrong_token() {
  return {401,
          "The token in this address is not valid. The daemon makes a new one each time it starts: open the "
          "address that it printed, or the one that `diastole console` prints."};
}

std::string AccessPolicy::url(ConsoleRole role, uint16_t port) const {
  std::string name = address_.address.to_string();
  if (address_.address.is_unspecified()) {
    name = machine_;
  } else if (address_.address.is_v6()) {
    name = "[" + name + "]";
  }
  return fmt::format("{}://{}:{}/#token={}", reaches_beyond_this_machine() ? "https" : "http", name, port,
                     role == ConsoleRole::control ? control_token_ : watch_token_);
}

std::string_view token_in(std::string_view authorization, std::string_view protocols) {
  constexpr std::string_view bearer = "Bearer ";
  constexpr std::string_view prefix = "token.";
  if (authorization.starts_with(bearer)) return authorization.substr(bearer.size());
  while (!protocols.empty()) {
    const size_t comma = std::min(protocols.find(','), protocols.size());
    std::string_view each = protocols.substr(0, comma);
    while (each.starts_with(' '))
      each.remove_prefix(1);
    if (each.starts_with(prefix)) return each.substr(prefix.size());
    protocols.remove_prefix(std::min(comma + 1, protocols.size()));
  }
  return {};
}

std::string new_token() {
  std::array<uint8_t, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw HardwareError("web console", "the kernel gives no random numbers", "Start without --console.");
  }
  std::string token;
  for (const uint8_t byte : bytes)
    token += fmt::format("{:02x}", byte);
  return token;
}

bool same_secret(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  volatile uint8_t difference = 0;  // volatile: every byte is looked at
  for (size_t i = 0; i < a.size(); ++i)
    difference = static_cast<uint8_t>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

}  // namespace diastole::web
