#pragma once
// JSON as text, whatever bytes its strings hold: names of files need not be UTF-8, and JSON has to be. And read from it, no
// deeper than programs write it: copying and writing a value recurse, and a deep one would take more stack than there is.

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace diastole {

/// `Json`: nlohmann's, ordered or not. Bytes that are no UTF-8 become U+FFFD. `indent` < 0: on one line.
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// Six levels are the most in a record.
inline constexpr int deepest_json = 64;

class JsonTooDeep : public std::invalid_argument {
 public:
  explicit JsonTooDeep(int levels)
      : std::invalid_argument(fmt::format("nested more than {} levels deep", levels)) {}
};

/// For Json::parse: throws JsonTooDeep while the text is read.
template <class Json>
auto no_deeper_than(int levels = deepest_json) {
  return [levels](int depth, typename Json::parse_event_t, Json&) {
    if (depth > levels) throw JsonTooDeep(levels);
    return true;
  };
}

}  // namespace diastole
