#pragma once
// The 4x4x4 Gauss points of the unit cube and the tables of basis values there, computed once.
//
// Point q = q1 + 4 q2 + 16 q3; 4 points a direction integrate degree 7 exactly. Fewer do not suffice: with
// 3x3x3 the outer wall of the gel phantom moves 4.7 % too far.

#include <array>
#include <cstddef>

#include "estimator/mesh/hermite_basis.hpp"

namespace diastole {

inline constexpr size_t line_points = 4;
inline constexpr size_t gauss_points = line_points * line_points * line_points;

/// Nodes and weights on 0..1; the weights sum to 1.
template <size_t Count>
struct LineRule {
  std::array<double, Count> place;
  std::array<double, Count> weight;
};

LineRule<4> line_rule_4();
LineRule<5> line_rule_5();

struct GaussTables {
  std::array<Xi, gauss_points> xi;
  std::array<double, gauss_points> weight;
  /// slope[q][k][a] = dN_a/dxi_k at point q.
  std::array<std::array<std::array<double, hermite_functions>, 3>, gauss_points> slope;
  std::array<std::array<double, corners>, gauss_points> trilinear;
  /// line[0][q][a] = h_a, line[1][q][a] = dh_a/dxi at the q-th place of one direction.
  std::array<std::array<std::array<double, 4>, line_points>, 2> line;
};

const GaussTables& gauss_tables();

}  // namespace diastole
