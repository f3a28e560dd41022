#pragma once
// Words of a text that somebody wrote: without the blanks around them, in small letters, as numbers, and quoted for a file;
// its characters.

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace diastole {

inline std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\n";
  const size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

inline std::string in_small_letters(std::string_view word) {
  std::string small(word);
  for (char& letter : small)
    letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return small;
}

/// UTF-8's byte order mark, which spreadsheets write first, says nothing.
inline std::string_view without_byte_order_mark(std::string_view text) {
  constexpr std::string_view mark = "\xEF\xBB\xBF";
  return text.starts_with(mark) ? text.substr(mark.size()) : text;
}

/// Of UTF-8.
inline bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }
inline size_t characters_of(std::string_view text) {
  return static_cast<size_t>(std::count_if(text.begin(), text.end(), begins_character));
}
/// The whole character that begins at this offset. Precondition: one does.
inline std::string_view character_at(std::string_view text, size_t offset) {
  size_t end = offset + 1;
  while (end < text.size() && !begins_character(text[end]))
    ++end;
  return text.substr(offset, end - offset);
}

/// The number that the whole of `text` is; "nan" and "inf" are numbers too.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "1,2,3": exactly `count` numbers between commas.
template <class Number, size_t count>
std::optional<std::array<Number, count>> parse_numbers(std::string_view text) {
  std::array<Number, count> values{};
  for (size_t i = 0; i < count; ++i) {
    const size_t comma = text.find(',');
    const auto value = parse_number<Number>(text.substr(0, comma));
    if (!value || (comma == std::string_view::npos) != (i + 1 == count)) return std::nullopt;
    values[i] = *value;
    text.remove_prefix(i + 1 == count ? text.size() : comma + 1);
  }
  return values;
}

/// As a basic string of TOML, without control characters.
inline std::string toml_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out.push_back('\\');
    if (static_cast<unsigned char>(c) >= 0x20) out.push_back(c);
  }
  return out + "\"";
}

}  // namespace diastole
