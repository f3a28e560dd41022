#pragma once
// Sums of fields over a mesh's nodes, which must be of one mesh.

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

inline void add_scaled(NodeField& field, double factor, const NodeField& direction) {
  if (factor == 0.0) return;
  for (size_t i = 0; i < field.size(); ++i)
    field[i] += factor * direction[i];
}

inline NodeField difference(NodeField a, const NodeField& b) {
  add_scaled(a, -1.0, b);
  return a;
}

}  // namespace diastole
