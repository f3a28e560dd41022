#include "estimator/fe/supports.hpp"

namespace diastole {

HeldDofs hold_nothing(const HermiteMesh& mesh) {
  HeldDofs held(mesh.node_count() * dofs_per_node, 0);
  for (const size_t dof : mesh.ties().zero)
    held[dof] = 1;
  return held;
}

void hold_face_component(const HermiteMesh& mesh, const std::vector<ElementFace>& faces, size_t component,
                         HeldDofs& held) {
  for (const ElementFace& face : faces) {
    for (const size_t corner : face_corners(face)) {
      const size_t node = mesh.element(face.element)[corner];
      for (size_t derivative = 0; derivative < nodal_derivatives; ++derivative) {
        const bool across_face = ((derivative >> face.direction) & 1) != 0;
        if (!across_face) held[dof_of(node, derivative, component)] = 1;
      }
    }
  }
}

void hold_face(const HermiteMesh& mesh, const std::vector<ElementFace>& faces, HeldDofs& held) {
  for (size_t component = 0; component < 3; ++component)
    hold_face_component(mesh, faces, component, held);
}

}  // namespace diastole
