#pragma once
// A cylinder about z whose elements end where one says: finer around a place, graded anyhow. Numbering and element axes are
// those of annulus.hpp; nodal derivatives are physical (per radian-like arc, per mm), elements scale them to their size.

#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct AnnulusGrid {
  std::vector<double> angles_deg;  ///< of the nodes around, rising, less than 360 apart; at least three
  std::vector<double> heights_mm;  ///< rising, at least two
  std::vector<double> radii_mm;    ///< rising, > 0, at least two
};

HermiteMesh make_annulus(const AnnulusGrid& grid);

}  // namespace diastole
