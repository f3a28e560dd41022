#include "estimator/explain/imaging/field_gap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "estimator/explain/imaging/linear_evidence.hpp"

namespace diastole::explain {

using Eigen::Index;

std::vector<size_t> deal_folds(const Measurement& measurement, const MotionResiduals& rows, size_t folds) {
  using Direction = std::array<long, 3>;
  const auto direction_of = [&](const ResidualRow& row) {
    Direction direction{};
    for (size_t i = 0; i < 3; ++i)
      direction[i] = std::lround(100.0 * measurement.tags[row.source].normal[i]);
    return direction;
  };
  std::map<Direction, size_t> sizes;
  for (const ResidualRow& row : rows.rows())
    if (rows.of_tag(row)) ++sizes[direction_of(row)];
  std::vector<std::pair<size_t, Direction>> largest_first;
  for (const auto& [direction, size] : sizes)
    largest_first.emplace_back(size, direction);
  std::ranges::sort(largest_first, std::greater{});
  std::vector<size_t> filled(folds, 0);
  std::map<Direction, size_t> fold_of;
  for (const auto& [size, direction] : largest_first) {
    const auto least = static_cast<size_t>(std::ranges::min_element(filled) - filled.begin());
    fold_of[direction] = least;
    filled[least] += size;
  }
  std::vector<size_t> result;
  for (const ResidualRow& row : rows.rows())
    result.push_back(rows.of_tag(row) ? fold_of[direction_of(row)] : row.source % folds);
  return result;
}

Eigen::VectorXd held_out_residuals(const FieldFit& fit, const std::vector<size_t>& folds) {
  const Index rows = fit.residuals.size();
  const Eigen::MatrixXd normal = fit.jacobian.transpose() * fit.jacobian;
  const Eigen::VectorXd gradient = fit.jacobian.transpose() * fit.all_residuals();
  Eigen::VectorXd predicted = fit.residuals;
  const size_t count = folds.empty() ? 0 : 1 + std::ranges::max(folds);
  for (size_t fold = 0; fold < count; ++fold) {
    std::vector<Index> out;
    for (Index i = 0; i < rows; ++i)
      if (folds[static_cast<size_t>(i)] == fold) out.push_back(i);
    const Eigen::MatrixXd left_out = fit.jacobian(out, Eigen::all);
    const Eigen::VectorXd without = gradient - left_out.transpose() * fit.residuals(out);
    const Eigen::VectorXd step = -(normal - left_out.transpose() * left_out).ldlt().solve(without);
    predicted(out) = fit.residuals(out) + left_out * step;
  }
  return predicted;
}

Gap field_gap(const FieldFit& base, const FieldFit& after, const std::vector<size_t>& folds,
              const Eigen::MatrixXd& directions) {
  const Eigen::MatrixXd basis = orthonormal_basis(directions);
  const Index rank = basis.cols();
  const auto reduced = [&](const FieldFit& fit) {
    return ((basis.transpose() * held_out_residuals(fit, folds)).squaredNorm() + fit.priors.squaredNorm()) /
           static_cast<double>(rank + fit.priors.size());
  };
  Gap gap;
  gap.before = reduced(base);
  gap.after = reduced(after);
  const double inside = (basis.transpose() * after.residuals).squaredNorm();
  gap.floor = (after.residuals.squaredNorm() - inside) / static_cast<double>(after.residuals.size() - rank);
  const double excess = gap.before - gap.floor;
  gap.closed = excess > 0.0 ? std::clamp(1.0 - (gap.after - gap.floor) / excess, 0.0, 1.0) : 0.0;
  gap.held_out = {"tags by their direction, a fifth at a time"};
  return gap;
}

}  // namespace diastole::explain
