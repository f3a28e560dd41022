#pragma once
// Follower pressure on the cavity's wall and the cavity's volume.
//
// The pressure's potential is -P V(x), so that its force is P times dV/dx = integral of N_a n dA with n the
// deformed normal pointing into the wall, and its tangent is d2V/dx dx: symmetric, because the wall's rims
// are held or slide in plates normal to z. V = 1/2 integral of (x n_x + y n_y) dA then needs no plates (their
// normal is along z). 5x5 Gauss points integrate all of it exactly (the integrand is of degree 8 along each
// xi).
//
// A loaded face whose rim is free (a beam pushed from one side) has an unsymmetric tangent. Its symmetric part
// is used: the forces, and so the solution, are exact, but Newton's method converges linearly, and may stall
// when such a face is pulled hard.
//
// Units: mm, mm^2, mm^3; times kPa by the caller.

#include <Eigen/Dense>
#include <array>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// The 16 functions of a face: those whose derivative across the face is not taken and whose corner is on it.
/// Numbered by the two directions (direction + 1) % 3 and (direction + 2) % 3.
inline constexpr size_t face_functions = 16;
std::array<size_t, face_functions> face_hermite_functions(const ElementFace& face);

using FaceField = Eigen::Matrix<double, 3, static_cast<int>(face_functions)>;
/// d2V/dx dx of one face, row 3 a + i, column 3 b + k over the face's functions.
using FaceTangent = Eigen::Matrix<double, 3 * face_functions, 3 * face_functions>;

/// One face's share of the cavity's volume.
double face_volume_mm3(const ElementFace& face, const ElementField& position_mm);

/// dV/dx: column a is the area vector that function a of the face sees.
FaceField face_area_mm2(const ElementFace& face, const ElementField& position_mm);

FaceTangent face_tangent_mm(const ElementFace& face, const ElementField& position_mm);

}  // namespace diastole
