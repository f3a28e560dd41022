#include "estimator/grids/field_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "estimator/grids/gmsh_file.hpp"
#include "estimator/grids/vtu_file.hpp"
#include "estimator/grids/xdmf_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

const std::vector<CellKind>& cell_kinds() {
  using enum CellShape;
  // VTK: vtkCellType.h; XDMF: XdmfTopologyType.cpp; Gmsh: its reference manual, MSH file format.
  static const std::vector<CellKind> kinds{{vertex, 1, 1, 1, 15, "Polyvertex"},
                                           {line, 2, 3, 2, 1, "Polyline"},
                                           {triangle, 3, 5, 4, 2, "Triangle"},
                                           {quadrilateral, 4, 9, 5, 3, "Quadrilateral"},
                                           {tetrahedron, 4, 10, 6, 4, "Tetrahedron"},
                                           {pyramid, 5, 14, 7, 7, "Pyramid"},
                                           {wedge, 6, 13, 8, 6, "Wedge"},
                                           {hexahedron, 8, 12, 9, 5, "Hexahedron"},
                                           {line, 3, 21, 34, 8, "Edge_3"},
                                           {triangle, 6, 22, 36, 9, "Triangle_6"},
                                           {quadrilateral, 8, 23, 37, 16, "Quadrilateral_8"},
                                           {quadrilateral, 9, 28, 35, 10, "Quadrilateral_9"},
                                           {tetrahedron, 10, 24, 38, 11, "Tetrahedron_10"},
                                           {wedge, 15, 26, 40, 18, "Wedge_15"},
                                           {hexahedron, 20, 25, 48, 17, "Hexahedron_20"},
                                           {hexahedron, 27, 29, 50, 12, "Hexahedron_27"}};
  return kinds;
}

size_t corner_count(CellShape shape) {
  return std::ranges::find(cell_kinds(), shape, &CellKind::shape)->points;
}

std::vector<std::vector<size_t>> faces_of(CellShape shape) {
  switch (shape) {
    case CellShape::tetrahedron:
      return {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    case CellShape::pyramid:
      return {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    case CellShape::wedge:
      return {{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
    case CellShape::hexahedron:
      return {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    case CellShape::triangle:
      return {{0, 1, 2}};
    case CellShape::quadrilateral:
      return {{0, 1, 2, 3}};
    default:
      return {};
  }
}

std::vector<GridCell> outer_faces(const FieldGrid& grid) {
  struct Seen {
    GridCell face;
    size_t count = 0;
  };
  std::map<std::vector<size_t>, Seen> faces;
  for (const GridCell& cell : grid.cells) {
    if (cell.shape < CellShape::tetrahedron) continue;
    for (const std::vector<size_t>& corners : faces_of(cell.shape)) {
      std::vector<size_t> points;
      for (const size_t corner : corners)
        points.push_back(cell.points[corner]);
      std::vector<size_t> sorted = points;
      std::ranges::sort(sorted);
      Seen& seen = faces[sorted];
      seen.face = {points.size() == 3 ? CellShape::triangle : CellShape::quadrilateral, points};
      ++seen.count;
    }
  }
  std::vector<GridCell> outer;
  for (const auto& [points, seen] : faces)
    if (seen.count == 1) outer.push_back(seen.face);
  return outer;
}

FieldGrid read_grid(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".vtu") return read_vtu(path);
  if (ending == ".xdmf" || ending == ".xmf") return read_xdmf(path);
  if (ending == ".msh") return read_gmsh(path);
  throw InputError(
      {path, "", fmt::format("the ending \"{}\" is of no grid that is read", ending),
       "Give a .vtu, .xdmf (beside its .h5) or .msh (Gmsh 2.2 or 4.1, ASCII); meshio converts others."});
}

void require_sound(const FieldGrid& grid, const std::string& file) {
  const auto fail = [&](std::string place, std::string problem) {
    throw InputError({file, std::move(place), std::move(problem), "Export the grid again."});
  };
  if (grid.points.empty()) fail("points", "there are none");
  if (grid.points.size() % 3 != 0)
    fail("points", fmt::format("have {} numbers, which is not three each", grid.points.size()));
  const auto require_finite = [&](const std::string& place, const std::vector<double>& values) {
    const auto bad = std::ranges::find_if_not(values, [](double v) { return std::isfinite(v); });
    if (bad != values.end()) fail(place, fmt::format("number {} is not finite", bad - values.begin()));
  };
  require_finite("points", grid.points);
  for (size_t c = 0; c < grid.cells.size(); ++c) {
    for (const size_t point : grid.cells[c].points)
      if (point >= grid.point_count())
        fail(fmt::format("cell {}", c), fmt::format("names point {} of {}", point, grid.point_count()));
  }
  const auto require_rows = [&](const GridArray& array, size_t rows, const char* what) {
    if (array.components == 0 || array.values.size() != rows * array.components) {
      fail(fmt::format("array {}", array.name),
           fmt::format("has {} numbers for {} {}", array.values.size(), rows, what));
    }
  };
  for (const GridArray& array : grid.cell_data)
    require_rows(array, grid.cells.size(), "cells");
  for (const GridStep& step : grid.steps)
    for (const GridArray& array : step.point_data)
      require_rows(array, grid.point_count(), "points");
}

}  // namespace diastole
