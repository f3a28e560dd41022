#pragma once
// The skew part that the free rims of a fluid's surface add to the tangent (face_edge.hpp), as triplets.

#include <span>
#include <vector>

#include "estimator/fe/equation_system.hpp"
#include "estimator/fe/face_edge.hpp"

namespace diastole {

class RimSkew {
 public:
  RimSkew(const EquationSystem& equations, std::vector<FaceEdge> rim);

  [[nodiscard]] bool empty() const { return rim_.empty(); }
  /// One half of the skew matrix, equations counted from 0; the other half is minus its mirror image.
  [[nodiscard]] std::span<const int> rows() const { return rows_; }
  [[nodiscard]] std::span<const int> columns() const { return columns_; }
  /// factor * skew, one number for each triplet.
  [[nodiscard]] std::vector<double> values(const HermiteMesh& mesh, const NodeField& position_mm,
                                           double factor) const;

 private:
  /// A pair of the edge's dofs 3 a + i that both have an equation.
  struct Pair {
    size_t edge;
    size_t row;
    size_t column;
  };
  std::vector<FaceEdge> rim_;
  std::vector<Pair> pairs_;
  std::vector<int> rows_;
  std::vector<int> columns_;
};

}  // namespace diastole
