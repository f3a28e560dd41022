#pragma once
// Texts of people that are kept in files and printed to terminals: UTF-8 (RFC 3629) without control characters, which steer a terminal;
// line ends and tabs are plain.

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace diastole {

/// The first place that is not plain, as "holds the control character 0x1b at byte 4" or "is not UTF-8 at byte 4"; empty if all is.
std::string why_not_plain(std::string_view text);

/// U+FFFD for what is not plain: for texts from anybody's file, before they are printed.
std::string made_plain(std::string_view text);

/// To standard output, with words from anybody's file among the arguments.
template <class... Arguments>
void print_plain(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::print("{}", made_plain(fmt::format(format, std::forward<Arguments>(arguments)...)));
}

}  // namespace diastole
