#pragma once
// A solution as `diastole solve -o NAME.json` keeps it for `diastole report` (format "diastole-solution",
// format_version 1): the figures of the solution, plane sections through the body before and after, and
// profiles through the wall, each with the scalar fields of docs/solutions.md. Lengths in mm, kPa.

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace diastole {

inline constexpr std::string_view solution_file_mark = "diastole-solution";

/// One number a cell of a section, or a point of a profile.
struct NamedField {
  std::string name;
  std::vector<double> values;
};

/// Null if there is none of this name.
inline const NamedField* find_field(const std::vector<NamedField>& fields, std::string_view name) {
  const auto found = std::ranges::find(fields, name, &NamedField::name);
  return found == fields.end() ? nullptr : &*found;
}

/// Horizontal and vertical place in the section: h0, v0, h1, v1, ...
using FlatPoints = std::vector<double>;

struct SolutionSection {
  std::string title;
  std::string horizontal;  ///< axis label with its unit
  std::string vertical;
  std::vector<FlatPoints> cells_before;  ///< polygons
  std::vector<FlatPoints> cells_after;
  FlatPoints outline_before;  ///< pairs of points: h0, v0, h1, v1 is one line
  FlatPoints outline_after;
  FlatPoints elements_before;  ///< likewise, between elements
  FlatPoints elements_after;
  std::vector<NamedField> fields;  ///< one value a cell
};

struct SolutionProfile {
  std::string title;
  std::vector<double> depth_mm;  ///< from the inner face, undeformed
  std::vector<NamedField> fields;
};

struct SolutionRecord {
  std::string study;
  std::string law;
  std::vector<std::pair<std::string, double>> parameters;
  std::vector<int> mesh;
  size_t unknowns = 0;
  double pressure_kPa = 0.0;
  std::optional<double> cavity_volume_mL;  ///< none of an open cavity
  std::optional<double> cavity_volume_change_mL;
  bool fibres = false;  ///< whether there are fields along f, s, n
  std::vector<SolutionSection> sections;
  std::vector<SolutionProfile> profiles;
};

std::string to_json(const SolutionRecord& record);

/// Whether text is such a record, by its format.
bool is_solution(std::string_view text);
/// Throws InputError (file, problem, remedy) unless it is a whole one; `file` stands for it in messages.
SolutionRecord solution_record_from_json(std::string_view text, const std::string& file);

}  // namespace diastole
