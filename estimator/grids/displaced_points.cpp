#include "estimator/grids/displaced_points.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

std::string names_of(const std::vector<GridArray>& arrays) {
  std::vector<std::string> names;
  for (const GridArray& array : arrays)
    names.push_back(fmt::format("{} ({})", array.name, array.components));
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

const GridArray& displacement_of(const GridStep& step, const DisplacementChoice& choice,
                                 const std::string& file) {
  const std::vector<std::string> usual{
      "displacement_mm", "displacement", "Displacement", "displacements", "u", "U"};
  for (const GridArray& array : step.point_data) {
    const bool named = choice.field.empty() ? std::ranges::find(usual, array.name) != usual.end()
                                            : array.name == choice.field;
    if (named && array.components == 3) return array;
  }
  throw InputError({file, choice.field.empty() ? "displacements" : "--field " + choice.field,
                    fmt::format("no array of three components at the points has {}",
                                choice.field.empty() ? "the name of a displacement" : "that name"),
                    fmt::format("Name one with --field; there are (with their components): {}.",
                                names_of(step.point_data))});
}

double tag_value(const FieldGrid& grid, const SurfaceChoice& choice, const std::string& file) {
  if (const auto named = grid.tag_names.find(choice.tag); named != grid.tag_names.end()) return named->second;
  if (const auto number = parse_number<double>(choice.tag)) return *number;
  std::vector<std::string> known;
  for (const auto& [name, number] : grid.tag_names)
    known.push_back(name);
  throw InputError({file, fmt::format("--{} {}", choice.surface, choice.tag),
                    "is neither a number nor a name in the file",
                    fmt::format("The file's names: {}.",
                                known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", ")))});
}

}  // namespace

DisplacedPoints displaced_points(const FieldGrid& grid, const DisplacementChoice& choice,
                                 const std::string& file) {
  DisplacedPoints result;
  result.points_csv = "frame,X_mm,Y_mm,Z_mm,x_mm,y_mm,z_mm,sigma_mm\n";
  result.points = grid.point_count();
  result.frames_csv = "frame,time_s,pressure_kPa,sigma_kPa\n";
  const double first_s = grid.steps.front().time_s;
  const GridArray& first = displacement_of(grid.steps.front(), choice, file);
  constexpr double rounding = 1e-9;  // of the largest coordinate
  const auto largest = [](const std::vector<double>& values) {
    double most = 0.0;
    for (const double value : values)
      most = std::max(most, std::abs(value));
    return most;
  };
  const bool at_rest = largest(first.values) <= rounding * largest(grid.points);
  if (!at_rest)
    fmt::format_to(std::back_inserter(result.frames_csv), "0,{},0,0\n", first_s > 0.0 ? 0.0 : first_s - 1.0);
  bool pressures = true;
  for (const GridStep& step : grid.steps) {
    const GridArray& moved = displacement_of(step, choice, file);
    const bool rest = at_rest && &step == &grid.steps.front();
    const size_t frame = rest ? 0 : ++result.frames;
    const auto pressure = std::ranges::find(step.field_data, "pressure_kPa", &GridArray::name);
    pressures = pressures && pressure != step.field_data.end();
    if (pressures)
      fmt::format_to(std::back_inserter(result.frames_csv), "{},{},{},0\n", frame, step.time_s,
                     pressure->values.front());
    if (rest) continue;
    for (size_t p = 0; p < grid.point_count(); ++p) {
      const auto out = std::back_inserter(result.points_csv);
      fmt::format_to(out, "{}", frame);
      for (size_t i = 0; i < 3; ++i)
        fmt::format_to(out, ",{}", choice.mm_per_unit * grid.points[3 * p + i]);
      for (size_t i = 0; i < 3; ++i)
        fmt::format_to(out, ",{}", choice.mm_per_unit * (grid.points[3 * p + i] + moved.values[3 * p + i]));
      fmt::format_to(out, ",{}\n", choice.sigma_mm);
    }
  }
  if (!pressures) result.frames_csv.clear();
  return result;
}

SurfacePoints surface_points(const FieldGrid& grid, const std::string& array,
                             const std::vector<SurfaceChoice>& choices, double mm_per_unit, double sigma_mm,
                             const std::string& file) {
  const auto tags = std::ranges::find(grid.cell_data, array, &GridArray::name);
  if (tags == grid.cell_data.end() || tags->components != 1) {
    throw InputError({file, "--array " + array, "is no array of one number a cell",
                      fmt::format("There are (with their components): {}.", names_of(grid.cell_data))});
  }
  SurfacePoints result{"phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm\n", {}};
  for (const SurfaceChoice& choice : choices) {
    const double value = tag_value(grid, choice, file);
    std::set<size_t> points;
    for (size_t c = 0; c < grid.cells.size(); ++c)
      if (tags->values[c] == value) points.insert(grid.cells[c].points.begin(), grid.cells[c].points.end());
    if (points.empty()) {
      throw InputError({file, fmt::format("--{} {}", choice.surface, choice.tag),
                        fmt::format("no cell has {} = {}", array, value),
                        "Give the value that the surface's cells carry."});
    }
    result.points.push_back(points.size());
    for (const size_t p : points)
      fmt::format_to(std::back_inserter(result.guide_csv), "0,grid,{},{},{},{},{}\n", choice.surface,
                     mm_per_unit * grid.points[3 * p], mm_per_unit * grid.points[3 * p + 1],
                     mm_per_unit * grid.points[3 * p + 2], sigma_mm);
  }
  return result;
}

}  // namespace diastole
