#pragma once
// FEBio models (.feb, spec 4.0): https://febio.org. A body of eight-node bricks and six-node wedges of one material, held at some
// points, with a pressure on some faces that follows a curve over time. Units: mm, kPa.

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "estimator/grids/field_grid.hpp"

namespace diastole {

struct FebMaterial {
  std::string type;                                        ///< of FEBio: "Mooney-Rivlin", "Fung orthotropic"
  std::vector<std::pair<std::string, double>> parameters;  ///< in its own names
};

struct FebModel {
  const FieldGrid* grid = nullptr;  ///< cells: hexahedra and wedges
  FebMaterial material;
  std::vector<std::array<double, 6>> axes;  ///< fibre, then a direction in the sheet, of each cell; or none
  std::vector<size_t> held;                 ///< points that do not move
  std::vector<GridCell> pressed;            ///< triangles and quadrilaterals, outwards from the material
  std::vector<double> pressures_kPa;        ///< one after the other, from 0 at rest
};

std::string feb_text(const FebModel& model);

}  // namespace diastole
