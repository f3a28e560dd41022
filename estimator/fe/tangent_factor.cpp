#include "estimator/fe/tangent_factor.hpp"

#include <utility>

#include "estimator/fe/condensed_factor.hpp"

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

bool TangentFactor::may_condense() {
  if (may_condense_ && !pattern_) {
    const size_t entries = equations_->entries();
    pattern_ = CondensedPattern::of(equations_->displacement_unknowns(), equations_->pressure_unknowns(),
                                    equations_->rows().first(entries), equations_->columns().first(entries));
    may_condense_ = pattern_ != nullptr && skew_->empty();
  }
  return may_condense_;
}

FactorResult TangentFactor::factorise_symmetric(std::span<double> values, bool cavity_held) {
  condensed_.reset();
  if (!cavity_held && may_condense()) condensed_ = CondensedFactor::of(pattern_, values);
  if (condensed_) return {.singular = false, .negative_pivots = equations_->pressure_unknowns()};
  std::unique_ptr<SparseFactor>& factor = cavity_held ? volume_given_ : pressure_given_;
  if (!factor) {
    const size_t entries = equations_->entries(cavity_held);
    factor =
        std::make_unique<SparseFactor>(equations_->unknowns(cavity_held), equations_->rows().first(entries),
                                       equations_->columns().first(entries));
  }
  current_ = factor.get();
  return current_->factorise(values);
}

FactorResult TangentFactor::factorise_general(std::span<const double> values, std::span<const double> skew) {
  condensed_.reset();
  if (!general_) prepare_general();
  general_values_.assign(values.begin(), values.end());
  for (size_t n = 0; n < values.size(); ++n) {
    if (equations_->rows()[n] != equations_->columns()[n]) general_values_.push_back(values[n]);
  }
  for (const double value : skew) {
    general_values_.push_back(value);
    general_values_.push_back(-value);
  }
  current_ = general_.get();
  return current_->factorise(general_values_);
}

void TangentFactor::solve(std::span<double> right_sides, size_t count) {
  if (condensed_) {
    condensed_->solve(right_sides, count);
  } else {
    current_->solve(right_sides, count);
  }
}

size_t TangentFactor::entries() const {
  if (condensed_) return condensed_->entries();
  return current_ == nullptr ? 0 : current_->entries();
}

void TangentFactor::prepare_general() {
  const size_t entries = equations_->entries();
  general_rows_.assign(equations_->rows().begin(),
                       equations_->rows().begin() + static_cast<std::ptrdiff_t>(entries));
  general_columns_.assign(equations_->columns().begin(),
                          equations_->columns().begin() + static_cast<std::ptrdiff_t>(entries));
  for (size_t n = 0; n < entries; ++n) {
    if (equations_->rows()[n] == equations_->columns()[n]) continue;
    general_rows_.push_back(equations_->columns()[n]);
    general_columns_.push_back(equations_->rows()[n]);
  }
  for (size_t n = 0; n < skew_->rows().size(); ++n) {
    for (const bool mirrored : {false, true}) {
      general_rows_.push_back(1 + (mirrored ? skew_->columns() : skew_->rows())[n]);
      general_columns_.push_back(1 + (mirrored ? skew_->rows() : skew_->columns())[n]);
    }
  }
  general_ = std::make_unique<SparseFactor>(equations_->unknowns(), general_rows_, general_columns_,
                                            MatrixKind::general);
}

}  // namespace diastole
