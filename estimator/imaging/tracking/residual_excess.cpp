#include "estimator/imaging/tracking/residual_excess.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/imaging/tracking/robust_weight.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

struct Part {
  double squares = 0, count = 0;
  void add(double off) {
    squares += off * off;
    count += 1;
  }
  [[nodiscard]] double mean() const { return squares / std::max(count, 1.0); }
};

/// Zero-filling makes next neighbours alike: of so many pixels one is new.
constexpr double pixels_alike = 2.0;

/// What two standard errors do not explain.
double excess_over(double typical, const Part& part, double typical_count) {
  if (part.count == 0) return 0;
  const double error = std::sqrt(2 * pixels_alike * (1 / part.count + 1 / typical_count));
  return std::max(0.0, part.mean() / std::max(typical, 1e-300) - 1 - 2 * error);
}

/// `visit(phase, row, column, off)` for each fitted pixel, `off` in the noise's standard deviations, as a fit counts it.
template <class Visit>
void each_fitted(const std::vector<TrackedPhase>& phases, const Visit& visit) {
  for (const TrackedPhase& phase : phases) {
    for (Eigen::Index column = 0; column < phase.residual.cols(); ++column) {
      for (Eigen::Index row = 0; row < phase.residual.rows(); ++row) {
        if (phase.residual(row, column) == 0) continue;
        const double off = std::abs(static_cast<double>(phase.residual(row, column))) / phase.noise;
        visit(phase, row, column, std::min(off, huber_limit));
      }
    }
  }
}

}  // namespace

ResidualExcess::ResidualExcess(const std::vector<TrackedPhase>& phases, const SlicePlane& plane,
                               double square_mm)
    : phases_(static_cast<double>(phases.size())), shell_mm_(0.5 * plane.finer_spacing_mm()) {
  rows_in_square_ =
      std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::lround(square_mm / plane.row_spacing_mm)));
  columns_in_square_ =
      std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::lround(square_mm / plane.column_spacing_mm)));
  const Eigen::Index down = plane.rows / rows_in_square_ + 1, across = plane.columns / columns_in_square_ + 1;
  std::vector<Part> squares(static_cast<size_t>(down * across));
  double all = 0;
  each_fitted(phases, [&](const TrackedPhase&, Eigen::Index row, Eigen::Index column, double off) {
    squares[static_cast<size_t>(row / rows_in_square_ + down * (column / columns_in_square_))].add(off);
    all += 1;
  });
  std::vector<double> means;
  for (const Part& square : squares)
    if (square.count > 0) means.push_back(square.mean());
  if (means.empty()) return;
  const double typical = signal::median(std::move(means));
  of_squares_.resize(down, across);
  std::ranges::transform(squares, of_squares_.data(),
                         [&](const Part& square) { return excess_over(typical, square, all); });

  std::vector<Part> shells;
  double clean = 0;
  each_fitted(phases, [&](const TrackedPhase& phase, Eigen::Index row, Eigen::Index column, double off) {
    if (!is_clean(row, column)) return;
    const auto shell =
        static_cast<size_t>(std::max(0.0, static_cast<double>(phase.depth_mm(row, column)) / shell_mm_));
    if (shell >= shells.size()) shells.resize(shell + 1);
    shells[shell].add(off);
    clean += 1;
  });
  Part deep;
  size_t edge = shells.size();
  while (edge > 0 && deep.count < 0.25 * clean) {
    --edge;
    deep.squares += shells[edge].squares;
    deep.count += shells[edge].count;
  }
  for (size_t i = 0; i < edge; ++i)
    of_shells_.push_back(excess_over(deep.mean(), shells[i], deep.count));
}

double ResidualExcess::at(const TrackedPhase& phase, Eigen::Index row, Eigen::Index column) const {
  if (of_squares_.size() == 0) return 0;
  const auto shell =
      static_cast<size_t>(std::max(0.0, static_cast<double>(phase.depth_mm(row, column)) / shell_mm_));
  return std::max(of_square(row, column), shell < of_shells_.size() ? of_shells_[shell] : 0.0);
}

}  // namespace diastole::imaging
