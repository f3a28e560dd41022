#pragma once
// What took long to compute and only depends on its key: texts kept in the user's cache folder (XDG_CACHE_HOME, or
// ~/.cache), where they may be deleted at any time. Without such a folder nothing is kept.

#include <optional>
#include <string>
#include <string_view>

namespace diastole {

/// `file`: a plain file name of what it is and for which key, "reference-1a2b3c4d.json".
std::optional<std::string> read_cached(std::string_view file);
/// Never fails: a folder that cannot be written keeps nothing.
void write_cached(std::string_view file, std::string_view text);

}  // namespace diastole
