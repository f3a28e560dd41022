#pragma once
// What a study takes from another laboratory's grid: displacements as NAME.points.csv, surfaces as NAME.guide.csv (docs/mesh-file.md).

#include <string>
#include <vector>

#include "estimator/grids/field_grid.hpp"

namespace diastole {

struct DisplacementChoice {
  std::string field;         ///< name of the array; empty: the one that is called like a displacement
  double mm_per_unit = 1.0;  ///< of coordinates and displacements
  double sigma_mm = 0.0;     ///< > 0: error of each component
};

struct DisplacedPoints {
  std::string points_csv;
  std::string frames_csv;  ///< empty unless every step has its pressure_kPa
  size_t frames = 0;       ///< with displacements
  size_t points = 0;       ///< in each
};

/// A frame for each step, beginning with 1; a first step without any displacement is the undeformed frame 0 itself. Throws InputError,
/// with the arrays that there are, if none has three components and that name.
DisplacedPoints displaced_points(const FieldGrid& grid, const DisplacementChoice& choice,
                                 const std::string& file);

/// Cells of surfaces by the value of a cell array: a number, or one of the grid's tag names.
struct SurfaceChoice {
  std::string surface;  ///< "endo", "epi", "base", "apex_endo", "apex_epi"
  std::string tag;
};

struct SurfacePoints {
  std::string guide_csv;
  std::vector<size_t> points;  ///< of each choice
};

/// The points of the cells that carry each tag, every point of a surface once. Throws InputError if there is no such array or no cell.
SurfacePoints surface_points(const FieldGrid& grid, const std::string& array,
                             const std::vector<SurfaceChoice>& choices, double mm_per_unit, double sigma_mm,
                             const std::string& file);

}  // namespace diastole
