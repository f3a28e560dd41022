#include "estimator/mesh/hermite_mesh.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "estimator/mesh/local_field.hpp"

namespace diastole {

HermiteMesh::HermiteMesh(NodeField reference, std::vector<Corners> elements, MeshFaces faces,
                         std::vector<Scales> scales, DofTies ties)
    : reference_(std::move(reference)),
      elements_(std::move(elements)),
      faces_(std::move(faces)),
      scales_(std::move(scales)),
      ties_(std::move(ties)),
      places_(node_count()) {
  std::iota(places_.begin(), places_.end(), size_t{0});
  for (const auto& [dof, other] : ties_.same) {
    if (dof % dofs_per_node == 0) places_[dof / dofs_per_node] = other / dofs_per_node;
  }
  for (size_t component = 0; component < 3; ++component) {
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (size_t node = 0; node < node_count(); ++node) {
      least = std::min(least, reference_[dof_of(node, 0, component)]);
      most = std::max(most, reference_[dof_of(node, 0, component)]);
    }
    extent_mm_ = std::max(extent_mm_, most - least);
  }
}

ElementField HermiteMesh::gather(size_t e, std::span<const double> field) const {
  ElementField local;
  for (size_t a = 0; a < hermite_functions; ++a) {
    const size_t node = elements_[e][hermite_corner(a)];
    const double factor = scale(e, a);
    for (size_t i = 0; i < 3; ++i) {
      local(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(a)) =
          factor * field[dof_of(node, hermite_derivative(a), i)];
    }
  }
  return local;
}

Eigen::Vector3d HermiteMesh::value(std::span<const double> field, const MaterialPoint& point) const {
  return local_value(gather(point.element, field), point.xi);
}

Eigen::Matrix3d HermiteMesh::xi_gradient(std::span<const double> field, const MaterialPoint& point) const {
  return local_field(gather(point.element, field), point.xi).slope;
}

Eigen::Matrix3d HermiteMesh::reference_gradient(std::span<const double> field,
                                                const MaterialPoint& point) const {
  return xi_gradient(field, point) * xi_gradient(reference_, point).inverse();
}

std::array<size_t, 4> face_corners(const ElementFace& face) {
  const size_t first = face.direction == 0 ? 1 : 0;
  const size_t second = face.direction == 2 ? 1 : 2;
  std::array<size_t, 4> found;
  for (size_t i = 0; i < 4; ++i) {
    found[i] = (face.side << face.direction) | ((i & 1) << first) | ((i >> 1) << second);
  }
  return found;
}

}  // namespace diastole
