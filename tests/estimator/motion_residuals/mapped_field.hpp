#pragma once
// A homogeneous motion of a mesh.

#include <Eigen/Core>

#include "estimator/mesh/node_field.hpp"

namespace diastole::test {

/// x = A X: a linear map of a node field is the map of each of its vectors.
inline NodeField mapped(const NodeField& field, const Eigen::Matrix3d& A) {
  NodeField result(field.size());
  for (size_t i = 0; i < field.size(); i += 3)
    Eigen::Map<Eigen::Vector3d>{&result[i]} = A * Eigen::Map<const Eigen::Vector3d>{&field[i]};
  return result;
}

}  // namespace diastole::test
