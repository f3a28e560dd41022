#pragma once
// Texts of people that are kept in files and printed to terminals: UTF-8 (RFC 3629) without control characters, which steer a terminal;
// line ends and tabs are plain.

#include <string>
#include <string_view>

namespace diastole {

/// The first place that is not plain, as "holds the control character 0x1b at byte 4" or "is not UTF-8 at byte 4"; empty if all is.
std::string why_not_plain(std::string_view text);

/// U+FFFD for what is not plain: for texts from anybody's file, before they are printed.
std::string made_plain(std::string_view text);

}  // namespace diastole
