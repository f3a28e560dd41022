#pragma once
// What only the people at the rig know of a run: /session of its run file (layout.hpp).

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

class H5Source;

/// What somebody wrote about a run, at its start or at any time afterwards.
struct SessionNote {
  std::string written_utc;  ///< ISO 8601
  std::string author;
  std::string text;
};

/// What only the people at the rig know of a run.
struct Session {
  std::map<std::string, Attribute, std::less<>> facts;  ///< specimen, operator, room_temperature_C
  std::vector<SessionNote> notes;                       ///< in the order in which they were written

  [[nodiscard]] bool empty() const { return facts.empty() && notes.empty(); }
  /// A fact that is a text; empty if it is not known.
  [[nodiscard]] std::string text(std::string_view fact) const {
    const auto found = facts.find(fact);
    const auto* value = found == facts.end() ? nullptr : std::get_if<std::string>(&found->second);
    return value == nullptr ? std::string() : *value;
  }
  /// A fact that is a number.
  [[nodiscard]] std::optional<double> number(std::string_view fact) const {
    const auto found = facts.find(fact);
    if (found == facts.end()) return std::nullopt;
    if (const auto* value = std::get_if<double>(&found->second)) return *value;
    if (const auto* value = std::get_if<int64_t>(&found->second)) return static_cast<double>(*value);
    return std::nullopt;
  }
};

/// Empty for a run of which nobody said anything. Throws InputError for what is no HDF5 file, or holds another kind of thing there;
/// nothing else of the file is read.
Session read_session(const std::filesystem::path& path);
/// The same of a file that is open (h5_source.hpp).
Session read_session(const H5Source& source);

}  // namespace diastole::runfile
