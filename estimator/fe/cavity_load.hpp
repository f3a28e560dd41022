#pragma once
// Follower pressure on one element face of a fluid's wall, and the face's share of the fluid's volume.
//
// The pressure's potential is -P V(x), so that its force is P times dV/dx = integral of N_a n dA with n the
// deformed normal pointing into the wall, and its tangent is d2V/dx dx. V = 1/2 integral of (x n_x + y n_y) dA
// needs no lids where they have their normal along z. Over a surface all this holds if its rim is held or at
// a plate; what a rim does is in fluid_surface.hpp. 5x5 Gauss points integrate all of it exactly.
//
// Units: mm, mm^2, mm^3; times kPa by the caller.

#include <Eigen/Dense>

#include "estimator/fe/face_points.hpp"

namespace diastole {

using FaceField = Eigen::Matrix<double, 3, static_cast<int>(face_functions)>;
/// d2V/dx dx of one face, row 3 a + i, column 3 b + k over the face's functions.
using FaceTangent = Eigen::Matrix<double, 3 * face_functions, 3 * face_functions>;

/// One face's share of the cavity's volume.
double face_volume_mm3(const ElementFace& face, const ElementField& position_mm);

/// dV/dx: column a is the area vector that function a of the face sees.
FaceField face_area_mm2(const ElementFace& face, const ElementField& position_mm);

/// The symmetric part of d(area)/dx: skew parts of neighbouring faces cancel along their common edges.
FaceTangent face_tangent_mm(const ElementFace& face, const ElementField& position_mm);

}  // namespace diastole
