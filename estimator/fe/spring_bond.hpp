#pragma once
// A face bonded to a rigid plate by springs: a thin glue line, or the cushion of a mount.
//
//   energy = 1/2 integral over the undeformed face of  k_n (u . N)^2 + k_t |u - (u . N) N|^2  dA,   u = x - X
//
// with N the undeformed normal: quadratic in the unknowns, so that one constant matrix holds all of it. As
// k_n and k_t grow it becomes supports.hpp's held face, as they vanish a free one. 5x5 Gauss points.
//
// Units: stiffness per area in kPa/mm; forces in kPa mm^2 = mN.

#include <vector>

#include "estimator/fe/cavity_load.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct SpringBond {
  double normal_kPa_per_mm = 0.0;
  double tangential_kPa_per_mm = 0.0;
};

/// Springs on some faces of a body.
struct BondedFaces {
  std::vector<ElementFace> faces;
  SpringBond bond;
};

/// Force on the face's coefficients per displacement of them: row 3 a + i, column 3 b + k over the face's functions.
FaceTangent bond_stiffness(const HermiteMesh& mesh, const ElementFace& face, const SpringBond& bond);

}  // namespace diastole
