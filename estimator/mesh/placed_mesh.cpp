#include "estimator/mesh/placed_mesh.hpp"

#include <utility>

namespace diastole {

HermiteMesh with_reference(const HermiteMesh& mesh, NodeField reference_mm) {
  std::vector<HermiteMesh::Corners> elements;
  std::vector<HermiteMesh::Scales> scales;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    elements.push_back(mesh.element(e));
    HermiteMesh::Scales& of_element = scales.emplace_back();
    for (size_t a = 0; a < hermite_functions; ++a)
      of_element[a] = mesh.scale(e, a);
  }
  return HermiteMesh(std::move(reference_mm), std::move(elements), mesh.faces(), std::move(scales),
                     mesh.ties());
}

HermiteMesh placed(const HermiteMesh& mesh, const Placement& placement) {
  NodeField field = mesh.reference();
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    for (size_t derivative = 0; derivative < nodal_derivatives; ++derivative) {
      Eigen::Map<Eigen::Vector3d> at(&field[dof_of(node, derivative, 0)]);
      at = derivative == 0 ? placement(at) : Eigen::Vector3d(placement.rotation * at);
    }
  }
  return with_reference(mesh, std::move(field));
}

}  // namespace diastole
