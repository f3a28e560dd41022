#pragma once
// VTKHDF files (.vtkhdf) of tri-cubic Bezier hexahedra, which ParaView draws as they are.
// https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/vtkhdf_specifications.html
//
//   /VTKHDF            Version [1, 0] (one step) or [2, 0] (several), Type "UnstructuredGrid"
//     NumberOfPoints, NumberOfCells, NumberOfConnectivityIds     one part
//     Points [64 cells, 3]   Connectivity [64 cells]   Offsets [cells + 1]   Types [cells] = 79
//     PointData/NAME [steps x points, components]   CellData/NAME   FieldData/NAME [steps]
//     CellData/HigherOrderDegrees [cells, 3] = 3
//     Steps (several steps only)   NSteps; Values, PartOffsets, NumberOfParts, PointOffsets, CellOffsets,
//                                  ConnectivityIdOffsets, PointDataOffsets/NAME, CellDataOffsets/NAME, ...
//
// The undeformed grid and the cells' data are stored once for all steps. Points are not shared between cells,
// because stress is not continuous; each cell has its 64 control points in VTK's order (mesh/bezier.hpp).
// A file of one step is read by VTK from 9.1 (ParaView 5.10) on, one of several from 9.3 (ParaView 5.12) on.

#include <filesystem>
#include <string>
#include <vector>

namespace diastole {

/// Rows of `components` numbers, one row a point or a cell. Names hold no '/' and no '.'.
struct GridArray {
  std::string name;
  size_t components = 1;
  std::vector<double> values;
};

struct GridStep {
  double time_s = 0.0;
  std::vector<GridArray> point_data;
  std::vector<GridArray> field_data;  ///< one row of one number each
};

struct BezierGrid {
  std::vector<double> points_mm;  ///< x, y, z of 64 control points a cell
  std::vector<GridArray> cell_data;
  std::vector<GridStep> steps;  ///< at least one; all with the same arrays
};

/// Replaces the file, or leaves it as it was. Throws InputError if it cannot be written.
void write_vtkhdf(const std::filesystem::path& path, const BezierGrid& grid);

}  // namespace diastole
