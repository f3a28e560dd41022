#include "protocol/contract/plain_text.hpp"

#include <fmt/format.h>

#include <cstdint>

namespace diastole {
namespace {

struct Character {
  size_t bytes = 0;  ///< 0: those that begin there are no UTF-8
  uint32_t code = 0;

  [[nodiscard]] bool plain() const {
    const bool is_control = (code < 0x20 && code != '\n' && code != '\t') || (code >= 0x7f && code < 0xa0);
    return bytes > 0 && !is_control;
  }
};

/// Precondition: not empty.
Character first_of(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<uint8_t>(text[i]); };
  const uint8_t lead = byte(0);
  if (text.starts_with("\r\n")) return {2, '\n'};  // Windows' line end
  if (lead < 0x80) return {1, lead};
  const size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  constexpr uint32_t least_of[] = {0, 0, 0x80, 0x800, 0x10000};
  if (lead < 0xc0 || lead > 0xf4 || text.size() < bytes) return {};
  uint32_t code = lead & (0x7fU >> bytes);
  for (size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0U) != 0x80U) return {};
    code = code << 6U | (byte(i) & 0x3fU);
  }
  const bool is_surrogate = code >= 0xd800 && code < 0xe000;
  if (code < least_of[bytes] || code > 0x10ffff || is_surrogate) return {};
  return {bytes, code};
}

}  // namespace

std::string why_not_plain(std::string_view text) {
  for (size_t at = 0; at < text.size();) {
    const Character character = first_of(text.substr(at));
    if (character.bytes == 0) return fmt::format("is not UTF-8 at byte {}", at);
    if (!character.plain())
      return fmt::format("holds the control character {:#04x} at byte {}", character.code, at);
    at += character.bytes;
  }
  return {};
}

std::string made_plain(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const Character character = first_of(text);
    const size_t bytes = character.bytes == 0 ? 1 : character.bytes;
    out += character.plain() ? text.substr(0, bytes) : std::string_view("\xEF\xBF\xBD");
    text.remove_prefix(bytes);
  }
  return out;
}

}  // namespace diastole
