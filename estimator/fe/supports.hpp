#pragma once
// Which nodal degrees of freedom are held at their reference values.

#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// One flag a degree of freedom, numbered as in a NodeField; 1 = held.
using HeldDofs = std::vector<unsigned char>;

/// Nothing but the derivatives that vanish at collapsed edges (HermiteMesh::ties), which are always held.
HeldDofs hold_nothing(const HermiteMesh& mesh);

/// A face bonded to a rigid plate: positions and all in-plane derivatives are held in the three components,
/// derivatives across the face stay free (the material may shear and stretch away from the plate).
void hold_face(const HermiteMesh& mesh, const std::vector<ElementFace>& faces, HeldDofs& held);

/// A face that slides on a frictionless plate: the same, for one component of space only (0 x, 1 y, 2 z).
void hold_face_component(const HermiteMesh& mesh, const std::vector<ElementFace>& faces, size_t component,
                         HeldDofs& held);

}  // namespace diastole
