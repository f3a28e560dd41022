#include "estimator/io/section_json.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace diastole {
namespace {

constexpr int drawn_digits = 6;  // significant ones

Json from_cells(const std::vector<FlatPoints>& cells) {
  Json json = Json::array();
  for (const FlatPoints& cell : cells)
    json.push_back(from_numbers(cell));
  return json;
}
std::vector<FlatPoints> to_cells(const Json& json) {
  std::vector<FlatPoints> cells;
  for (const Json& cell : json)
    cells.push_back(to_numbers(cell));
  return cells;
}

}  // namespace

Json from_numbers(const std::vector<double>& values) {
  Json json = Json::array();
  for (const double value : values) {
    double rounded = value;
    if (std::isfinite(value) && value != 0.0) {
      const double power = std::pow(10.0, drawn_digits - 1 - std::floor(std::log10(std::abs(value))));
      rounded = std::abs(value) < 1e-9 ? 0.0 : std::round(value * power) / power;
    }
    json.push_back(std::isfinite(value) ? Json(rounded) : Json(nullptr));
  }
  return json;
}
std::vector<double> to_numbers(const Json& json) {
  std::vector<double> values;
  for (const Json& value : json)
    values.push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>());
  return values;
}

Json from_fields(const std::vector<NamedField>& fields) {
  Json json = Json::object();
  for (const NamedField& field : fields)
    json[field.name] = from_numbers(field.values);
  return json;
}
std::vector<NamedField> to_fields(const Json& json, size_t count) {
  std::vector<NamedField> fields;
  for (const auto& [name, values] : json.items()) {
    fields.push_back({name, to_numbers(values)});
    if (fields.back().values.size() != count) throw std::invalid_argument(name + " has another length");
  }
  return fields;
}

Json from_section(const SolutionSection& section) {
  return {{"title", section.title},
          {"horizontal", section.horizontal},
          {"vertical", section.vertical},
          {"cells_before", from_cells(section.cells_before)},
          {"cells_after", from_cells(section.cells_after)},
          {"outline_before", from_numbers(section.outline_before)},
          {"outline_after", from_numbers(section.outline_after)},
          {"elements_before", from_numbers(section.elements_before)},
          {"elements_after", from_numbers(section.elements_after)},
          {"fields", from_fields(section.fields)}};
}
SolutionSection to_section(const Json& json) {
  SolutionSection section{.title = json.at("title"),
                          .horizontal = json.at("horizontal"),
                          .vertical = json.at("vertical"),
                          .cells_before = to_cells(json.at("cells_before")),
                          .cells_after = to_cells(json.at("cells_after")),
                          .outline_before = to_numbers(json.at("outline_before")),
                          .outline_after = to_numbers(json.at("outline_after")),
                          .elements_before = to_numbers(json.at("elements_before")),
                          .elements_after = to_numbers(json.at("elements_after")),
                          .fields = {}};
  if (section.cells_before.size() != section.cells_after.size())
    throw std::invalid_argument("cells_before and cells_after differ in number");
  section.fields = to_fields(json.at("fields"), section.cells_before.size());
  return section;
}

}  // namespace diastole
