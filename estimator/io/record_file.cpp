#include "estimator/io/record_file.hpp"

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

constexpr unsigned newest_version = 1;

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
  const auto refuse = [&](const char* place, std::string problem) {
    return InputError({file, place, std::move(problem), std::string(remedy)});
  };
  try {
    const Json json = Json::parse(text, no_deeper_than<Json>());
    if (is_named_always && (!json.is_object() || json.value("format", "") != name))
      throw refuse("key format", fmt::format("is not \"{}\"", name));
    unsigned version = newest_version;
    if (is_named_always || (json.is_object() && json.contains("format_version")))
      read_json(json.at("format_version"), version);
    if (version > newest_version) {
      throw InputError(
          {file, "key format_version",
           fmt::format("version {} is newer than this program knows ({})", version, newest_version),
           "Update the program."});
    }
    take(json);
  } catch (const nlohmann::json::exception& error) {
    throw refuse("", fmt::format("is not {}: {}", kind, error.what()));
  } catch (const std::invalid_argument& error) {
    throw refuse("", fmt::format("is not {}: {}", kind, error.what()));
  }
}

}  // namespace diastole
