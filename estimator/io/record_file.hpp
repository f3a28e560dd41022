#pragma once
// What all files of one JSON record share: the format's name and its version before the record's own keys.
//
//   {"format": "diastole-solution", "format_version": 1, "study": ...}

#include <functional>
#include <string>
#include <string_view>

#include "estimator/io/member_json.hpp"

namespace diastole {

/// Throws InputError with file, key, problem and remedy if a record cannot be read. All formats are of version 1.
struct RecordFormat {
  std::string_view name;        ///< "diastole-solution"
  std::string_view kind;        ///< "a solution"
  std::string_view remedy;      ///< how to get one
  bool is_named_always = true;  ///< or a document without the two keys is read too

  /// Whether a text has the format's name near its start.
  [[nodiscard]] bool marks(std::string_view text) const;
  /// A record's document.
  [[nodiscard]] Json document(const Json& record) const;
  /// `take` may throw MemberFault, whose key then is the place, and std::invalid_argument.
  void read(std::string_view text, const std::string& file,
            const std::function<void(const Json&)>& take) const;

 private:
  void require_known_version(const Json& json, const std::string& file) const;
};

}  // namespace diastole
