#include "estimator/fe/condensed_factor.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace diastole {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Of B' W B over K in the directions that change volume: in each correction an error of the pressures shrinks by as much, and
/// rounding errors are larger by as much. With 1e5 a back-substitution less would do, but solutions would be off by 2e-9.
constexpr double volume_over_shape = 1e4;
constexpr double settled = 1e-7;  // change of the pressures, relative: the next would be a thousandth of it
constexpr int most_corrections = 6;
/// A pivot smaller than that, of its diagonal entry, may be a rounding error.
constexpr double least_pivot = 1e-13;

}  // namespace

std::shared_ptr<CondensedPattern> CondensedPattern::of(size_t displacements, size_t pressures,
                                                       std::span<const int> rows,
                                                       std::span<const int> columns) {
  std::shared_ptr<CondensedPattern> pattern(new CondensedPattern);
  pattern->displacements_ = displacements;
  pattern->pressures_ = pressures;
  if (pressures == 0 ||
      std::ranges::any_of(columns, [&](int column) { return column > static_cast<int>(displacements); }))
    return nullptr;
  return pattern->map_displacements(rows, columns) && pattern->map_pressures(rows, columns) ? pattern
                                                                                            : nullptr;
}

bool CondensedPattern::map_displacements(std::span<const int> rows, std::span<const int> columns) {
  const auto is_stored = [&](size_t n) { return rows[n] <= static_cast<int>(displacements_); };
  std::vector<int> starts(displacements_ + 1, 0);
  for (size_t n = 0; n < rows.size(); ++n) {
    if (is_stored(n)) ++starts[static_cast<size_t>(rows[n])];
  }
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  std::vector<int> next(starts.begin(), starts.end() - 1);
  entries_.resize(static_cast<size_t>(starts.back()));
  for (size_t n = 0; n < rows.size(); ++n) {
    if (is_stored(n)) entries_[static_cast<size_t>(next[static_cast<size_t>(rows[n] - 1)]++)] = n;
  }
  for (size_t j = 0; j < displacements_; ++j) {
    std::sort(entries_.begin() + starts[j], entries_.begin() + starts[j + 1],
              [&](size_t a, size_t b) { return columns[a] < columns[b]; });
  }
  std::vector<int> stored_rows(entries_.size());
  std::ranges::transform(entries_, stored_rows.begin(), [&](size_t n) { return columns[n] - 1; });
  matrix_ = CholeskyPattern::of(std::move(starts), std::move(stored_rows));
  return matrix_ != nullptr;
}

bool CondensedPattern::map_pressures(std::span<const int> rows, std::span<const int> columns) {
  std::vector<std::vector<std::pair<int, size_t>>> met(pressures_);  // displacement and triplet
  for (size_t n = 0; n < rows.size(); ++n) {
    if (rows[n] > static_cast<int>(displacements_))
      met[static_cast<size_t>(rows[n]) - displacements_ - 1].emplace_back(columns[n] - 1, n);
  }
  for (size_t m = 0; m < pressures_; ++m) {
    std::sort(met[m].begin(), met[m].end());
    std::vector<int> displacements;
    for (const auto& [displacement, entry] : met[m])
      displacements.push_back(displacement);
    if (groups_.empty() || groups_.back().displacements != displacements)
      groups_.push_back({{}, std::move(displacements), {}, {}});
    groups_.back().pressures.push_back(static_cast<int>(m));
    for (const auto& [displacement, entry] : met[m])
      groups_.back().entries.push_back(entry);
  }
  return std::ranges::all_of(groups_, [this](Group& group) { return map_places(group); });
}

bool CondensedPattern::map_places(Group& group) const {
  const std::vector<int>&starts = matrix_->column_starts(), &rows = matrix_->rows();
  for (auto column = group.displacements.begin(); column != group.displacements.end(); ++column) {
    auto stored = rows.begin() + starts[static_cast<size_t>(*column)];
    const auto end = rows.begin() + starts[static_cast<size_t>(*column) + 1];
    for (auto row = group.displacements.begin(); row != column + 1; ++row) {
      stored = std::find(stored, end, *row);
      if (stored == end) return false;
      group.places.push_back(static_cast<int>(stored - rows.begin()));
    }
  }
  return true;
}

std::shared_ptr<const CondensedFactor> CondensedFactor::of(std::shared_ptr<const CondensedPattern> pattern,
                                                           std::span<const double> values) {
  std::shared_ptr<CondensedFactor> factor(new CondensedFactor(std::move(pattern)));
  std::vector<double> matrix(factor->pattern_->entries_.size());
  std::ranges::transform(factor->pattern_->entries_, matrix.begin(), [&](size_t n) { return values[n]; });
  factor->condense(values, matrix);
  factor->factor_ = CholeskyFactor::of(factor->pattern_->matrix_, matrix, least_pivot);
  return factor->factor_ ? factor : nullptr;
}

void CondensedFactor::condense(std::span<const double> values, std::vector<double>& matrix) {
  weights_.resize(static_cast<Index>(pattern_->pressures_));
  for (const CondensedPattern::Group& group : pattern_->groups_) {
    const size_t count = group.displacements.size();
    Coupling& coupling = coupling_.emplace_back(group.pressures.size(), count);
    std::ranges::transform(group.entries, coupling.data(), [&](size_t n) { return values[n]; });
    Eigen::VectorXd diagonal(static_cast<Index>(count));
    for (size_t j = 0, place = 0; j < count; place += ++j + 1)
      diagonal[static_cast<Index>(j)] =
          std::abs(values[pattern_->entries_[static_cast<size_t>(group.places[place])]]);
    // An estimate of B K^-1 B', whose inverse is what each pressure resists with.
    const Eigen::VectorXd resisted = coupling.cwiseAbs2() * diagonal.cwiseInverse();
    const Eigen::VectorXd weights = volume_over_shape * resisted.cwiseInverse();
    weights_(group.pressures) = weights;
    const MatrixXd weighted = weights.cwiseSqrt().asDiagonal() * coupling;
    MatrixXd added = MatrixXd::Zero(static_cast<Index>(count), static_cast<Index>(count));
    added.selfadjointView<Eigen::Upper>().rankUpdate(weighted.transpose());
    auto place = group.places.begin();
    for (Index j = 0; j < added.cols(); ++j) {
      for (Index i = 0; i <= j; ++i)
        matrix[static_cast<size_t>(*place++)] += added(i, j);
    }
  }
}

void CondensedFactor::add_pull(const MatrixXd& pressures, MatrixXd& displacements) const {
  for (size_t g = 0; g < coupling_.size(); ++g) {
    const CondensedPattern::Group& group = pattern_->groups_[g];
    const MatrixXd pressing = pressures(group.pressures, Eigen::all);
    displacements(group.displacements, Eigen::all) += coupling_[g].transpose() * pressing;
  }
}

void CondensedFactor::add_growth(const MatrixXd& displacements, MatrixXd& pressures) const {
  for (size_t g = 0; g < coupling_.size(); ++g) {
    const CondensedPattern::Group& group = pattern_->groups_[g];
    const MatrixXd moved = displacements(group.displacements, Eigen::all);
    pressures(group.pressures, Eigen::all) += coupling_[g] * moved;
  }
}

void CondensedFactor::solve(std::span<double> right_sides, size_t count) const {
  solve_corrected(right_sides, count, most_corrections);
}

void CondensedFactor::solve_roughly(std::span<double> right_side) const { solve_corrected(right_side, 1, 0); }

void CondensedFactor::solve_corrected(std::span<double> right_sides, size_t count, int corrections) const {
  const auto displacements = static_cast<Index>(pattern_->displacements_);
  const auto all = displacements + static_cast<Index>(pattern_->pressures_);
  Eigen::Map<MatrixXd> columns(right_sides.data(), all, static_cast<Index>(count));
  MatrixXd growth = -columns.bottomRows(all - displacements);  // B u - g, for u = 0 at first
  MatrixXd pressures = MatrixXd::Zero(growth.rows(), growth.cols());
  MatrixXd pull = columns.topRows(displacements);
  columns.setZero();
  for (int correction = 0; correction <= corrections; ++correction) {
    const MatrixXd weighted = weights_.asDiagonal() * growth;
    add_pull(-weighted, pull);
    const MatrixXd change = factor_->solve(std::move(pull));
    columns.topRows(displacements) += change;
    add_growth(change, growth);
    const MatrixXd pressure_change = weights_.asDiagonal() * growth;
    pressures += pressure_change;
    if ((pressure_change.colwise().norm().array() <= settled * pressures.colwise().norm().array()).all())
      break;
    pull = MatrixXd::Zero(displacements, static_cast<Index>(count));
  }
  columns.bottomRows(pressures.rows()) = pressures;
}

}  // namespace diastole
