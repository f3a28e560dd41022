#pragma once
// JSON as text, whatever bytes its strings hold: names of files need not be UTF-8, and JSON has to be.

#include <string>

namespace diastole {

/// `Json`: nlohmann's, ordered or not. Bytes that are no UTF-8 become U+FFFD. `indent` < 0: on one line.
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace diastole
