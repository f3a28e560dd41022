#include "estimator/fe/rim_skew.hpp"

#include <utility>

namespace diastole {

RimSkew::RimSkew(const EquationSystem& equations, std::vector<FaceEdge> rim) : rim_(std::move(rim)) {
  for (size_t e = 0; e < rim_.size(); ++e) {
    const auto functions = edge_hermite_functions(rim_[e]);
    const auto equation = [&](size_t dof) {
      return equations.equation(rim_[e].face.element, functions[dof / 3], dof % 3);
    };
    for (size_t row = 0; row < 3 * edge_functions; ++row) {
      for (size_t column = 0; column < row; ++column) {
        if (equation(row) == EquationSystem::none || equation(column) == EquationSystem::none) continue;
        pairs_.push_back({e, row, column});
        rows_.push_back(static_cast<int>(equation(row)));
        columns_.push_back(static_cast<int>(equation(column)));
      }
    }
  }
}

std::vector<double> RimSkew::values(const HermiteMesh& mesh, const NodeField& position_mm,
                                    double factor) const {
  std::vector<EdgeTangent> of_edge;
  for (const FaceEdge& edge : rim_)
    of_edge.push_back(rim_skew_mm(edge, mesh.gather(edge.face.element, position_mm)));
  std::vector<double> values;
  for (const auto& [e, row, column] : pairs_) {
    const auto functions = edge_hermite_functions(rim_[e]);
    const size_t element = rim_[e].face.element;
    const double scale = mesh.scale(element, functions[row / 3]) * mesh.scale(element, functions[column / 3]);
    values.push_back(factor * scale *
                     of_edge[e](static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)));
  }
  return values;
}

}  // namespace diastole
