#include "estimator/io/record_file.hpp"

#include <algorithm>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

constexpr unsigned newest_version = 1;

/// Of the character before which `read` characters were read, the last of them included.
std::string place_of(std::string_view text, size_t read) {
  const std::string_view before = text.substr(0, read > 0 ? read - 1 : 0);
  return fmt::format("line {}, column {}", 1 + std::ranges::count(before, '\n'),
                     before.size() - (before.rfind('\n') + 1) + 1);
}

}  // namespace

bool RecordFormat::marks(std::string_view text) const {
  constexpr size_t head = 200;
  return text.substr(0, head).find(name) != std::string_view::npos;
}

Json RecordFormat::document(const Json& record) const {
  Json json = {{"format", name}, {"format_version", newest_version}};
  json.update(record);
  return json;
}

void RecordFormat::read(std::string_view text, const std::string& file,
                        const std::function<void(const Json&)>& take) const {
  const auto refused = [&](const std::string& place, const std::string& problem) {
    return InputError({file, place, problem, std::string(remedy)});
  };
  try {
    const Json json = Json::parse(text, no_deeper_than<Json>());
    if (is_named_always && (!json.is_object() || json.value("format", Json()) != Json(name)))
      throw MemberFault(fmt::format("is not \"{}\"", name), "format");
    require_known_version(json, file);
    take(json);
  } catch (const MemberFault& fault) {
    if (fault.member().empty()) throw refused("", fmt::format("is not {}: {}", kind, fault.what()));
    throw refused("key " + fault.member(), fault.what());
  } catch (const std::invalid_argument& error) {
    throw refused("", fmt::format("is not {}: {}", kind, error.what()));
  } catch (const Json::parse_error& error) {
    throw refused(place_of(text, error.byte), fmt::format("is not {}: this is no JSON", kind));
  } catch (const Json::exception& error) {
    constexpr int number_overflow = 406;
    throw refused("", fmt::format("is not {}: {}", kind,
                                  error.id == number_overflow ? "it has a number beyond all that are kept"
                                                              : "a value is missing or of another kind"));
  }
}

void RecordFormat::require_known_version(const Json& json, const std::string& file) const {
  if (!json.contains("format_version")) {
    if (is_named_always) throw MemberFault("is missing", "format_version");
    return;
  }
  unsigned version = newest_version;
  try {
    read_json(json.at("format_version"), version);
  } catch (const MemberFault& fault) {
    throw within("format_version", fault);
  }
  if (version > newest_version) {
    throw InputError(
        {file, "key format_version",
         fmt::format("version {} is newer than this program knows ({})", version, newest_version),
         "Update the program."});
  }
}

}  // namespace diastole
