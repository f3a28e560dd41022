#pragma once
// Grids of plain cells with fields at their points, as other laboratories' programs write and read them. Data, not bodies: points and
// surfaces to fit our mesh to, displacements to fit a law to.
//
//   cell        corners, in the order of XDMF and Gmsh, and of VTK but for its wedge        faces_of() look outwards
//   tetra       3             hexahedron    7----6          wedge    5
//              /|\                         /|   /|                  /|\      .
//             0-+-2                       4----5 |                 3-+-4
//              \|/                        | 3--|-2                 | 2 |
//               1                         |/   |/                  |/ \|
//                                         0----1                   0---1
//
// Cells of higher order are read with their corners; their other points stay points. Units are those of the file.

#include <map>
#include <string>
#include <vector>

#include "estimator/io/vtkhdf_file.hpp"

namespace diastole {

enum class CellShape { vertex, line, triangle, quadrilateral, tetrahedron, pyramid, wedge, hexahedron };

struct GridCell {
  CellShape shape;
  std::vector<size_t> points;  ///< corners, counted from 0
};

struct FieldGrid {
  std::vector<double> points;  ///< x, y, z
  std::vector<GridCell> cells;
  std::vector<GridArray> cell_data;  ///< of all steps
  std::vector<GridStep> steps;  ///< fields at the points by time; one without fields if the file has none
  std::map<std::string, double>
      tag_names;  ///< Gmsh's physical names, which stand for values of the cell data `physical`

  [[nodiscard]] size_t point_count() const { return points.size() / 3; }
};

size_t corner_count(CellShape shape);
/// Faces of a cell of three dimensions, each as places among its corners; a triangle or quadrilateral is its own.
std::vector<std::vector<size_t>> faces_of(CellShape shape);

/// The faces of cells of three dimensions that no second cell has.
std::vector<GridCell> outer_faces(const FieldGrid& grid);

/// A shape by VTK's number for it, or by that of XDMF (also in mixed topologies); `points` is how many the file has for the cell.
struct CellKind {
  CellShape shape;
  size_t points;
  int vtk;
  int xdmf;
  int gmsh;
  const char* xdmf_name;
};
/// Linear shapes first; empty if none has the number.
const std::vector<CellKind>& cell_kinds();

/// By the file's ending: .vtu, .xdmf, .msh. Throws InputError for another, and for whatever is wrong in it: cells of points that do not
/// exist, arrays of another length, numbers that are none, all with the place.
FieldGrid read_grid(const std::string& path);

/// What is checked of every grid. Throws InputError.
void require_sound(const FieldGrid& grid, const std::string& file);

}  // namespace diastole
