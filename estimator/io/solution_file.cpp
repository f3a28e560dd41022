#include "estimator/io/solution_file.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "estimator/io/section_json.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr int newest_version = 1;

/// A whole number from 0; of others the conversion to an integer is not defined.
template <typename Whole>
Whole to_whole(const Json& json) {
  if (!json.is_number_unsigned() || !std::in_range<Whole>(json.get<uint64_t>()))
    throw std::invalid_argument(json.dump() + " is no whole number in range");
  return static_cast<Whole>(json.get<uint64_t>());
}

Json from_optional(const std::optional<double>& value) { return value ? Json(*value) : Json(); }
std::optional<double> to_optional(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional<double>(json.get<double>());
}

SolutionRecord to_record(const Json& json) {
  SolutionRecord record;
  record.study = json.at("study");
  record.law = json.at("law");
  for (const auto& [name, value] : json.at("parameters").items())
    record.parameters.emplace_back(name, value.get<double>());
  for (const Json& count : json.at("mesh"))
    record.mesh.push_back(to_whole<int>(count));
  record.unknowns = to_whole<size_t>(json.at("unknowns"));
  record.pressure_kPa = json.at("pressure_kPa");
  record.cavity_volume_mL = to_optional(json.at("cavity_volume_mL"));
  record.cavity_volume_change_mL = to_optional(json.at("cavity_volume_change_mL"));
  record.fibres = json.at("fibres");
  for (const Json& section : json.at("sections"))
    record.sections.push_back(to_section(section));
  for (const Json& profile : json.at("profiles")) {
    std::vector<double> depth_mm = to_numbers(profile.at("depth_mm"));
    std::vector<NamedField> fields = to_fields(profile.at("fields"), depth_mm.size());
    record.profiles.push_back({profile.at("title"), std::move(depth_mm), std::move(fields)});
  }
  return record;
}

}  // namespace

std::string to_json(const SolutionRecord& record) {
  Json json = {{"format", solution_file_mark}, {"format_version", newest_version}};
  json["study"] = record.study;
  json["law"] = record.law;
  json["parameters"] = Json::object();
  for (const auto& [name, value] : record.parameters)
    json["parameters"][name] = value;
  json["mesh"] = record.mesh;
  json["unknowns"] = record.unknowns;
  json["pressure_kPa"] = record.pressure_kPa;
  json["cavity_volume_mL"] = from_optional(record.cavity_volume_mL);
  json["cavity_volume_change_mL"] = from_optional(record.cavity_volume_change_mL);
  json["fibres"] = record.fibres;
  json["sections"] = Json::array();
  for (const SolutionSection& section : record.sections)
    json["sections"].push_back(from_section(section));
  json["profiles"] = Json::array();
  for (const SolutionProfile& profile : record.profiles) {
    json["profiles"].push_back({{"title", profile.title},
                                {"depth_mm", from_numbers(profile.depth_mm)},
                                {"fields", from_fields(profile.fields)}});
  }
  return json.dump() + "\n";
}

bool is_solution(std::string_view text) {
  constexpr size_t head = 200;
  return text.substr(0, head).find(solution_file_mark) != std::string_view::npos;
}

SolutionRecord solution_record_from_json(std::string_view text, const std::string& file) {
  const std::string remedy = "Give a file that `diastole solve STUDY -o NAME.json` wrote.";
  try {
    const Json json = Json::parse(text);
    if (!json.is_object() || json.value("format", "") != solution_file_mark)
      throw InputError({file, "key format", fmt::format("is not \"{}\"", solution_file_mark), remedy});
    const int version = to_whole<int>(json.at("format_version"));
    if (version > newest_version) {
      throw InputError(
          {file, "key format_version",
           fmt::format("version {} is newer than this program knows ({})", version, newest_version),
           "Update the program."});
    }
    return to_record(json);
  } catch (const nlohmann::json::exception& error) {
    throw InputError({file, "", fmt::format("is not a solution: {}", error.what()), remedy});
  } catch (const std::invalid_argument& error) {
    throw InputError({file, "", fmt::format("is not a solution: {}", error.what()), remedy});
  }
}

}  // namespace diastole
