#include "estimator/explain/rig/law_fit.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// k(x, y) for distances over the largest.
double wiener_kernel(double x, double y) {
  if (x * y <= 0.0) return 0.0;
  const double m = std::min(std::abs(x), std::abs(y));
  const double M = std::max(std::abs(x), std::abs(y));
  return 0.5 * m * m * (3.0 * M - m);
}

MatrixXd side_by_side(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd both(a.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

/// argmin g'H g / 2 - c'g, g >= 0, by coordinates in turn.
VectorXd nonnegative_minimum(const MatrixXd& H, const VectorXd& c) {
  constexpr int most_sweeps = 5000;
  constexpr double small = 1e-9;
  VectorXd g = VectorXd::Zero(c.size());
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    double moved = 0.0;
    for (Index i = 0; i < g.size(); ++i) {
      const double next = std::max(0.0, g[i] + (c[i] - H.row(i).dot(g)) / H(i, i));
      moved = std::max(moved, std::abs(next - g[i]) * std::sqrt(H(i, i)));
      g[i] = next;
    }
    if (moved < small) break;
  }
  return g;
}

/// Which increments are there, if those that would be negative are not.
std::vector<Index> present_increments(const LawProblem& problem, const rig::EvidenceFit& fit,
                                      const MatrixXd& root, const MatrixXd& increments) {
  const Index count = root.cols();
  const Index others = fit.precision.cols() - count;
  const VectorXd weighted = problem.target.cwiseQuotient(fit.variance);
  const VectorXd right = (problem.responses * root).transpose() * weighted;
  const VectorXd right_others = problem.known.transpose() * weighted;
  const Eigen::LLT<MatrixXd> of_others(fit.precision.bottomRightCorner(others, others));
  const MatrixXd across = fit.precision.topRightCorner(count, others);
  const MatrixXd reduced =
      fit.precision.topLeftCorner(count, count) - across * of_others.solve(across.transpose());
  const MatrixXd to_unit = root.triangularView<Eigen::Lower>().solve(increments);
  const VectorXd along = to_unit.transpose() * (right - across * of_others.solve(right_others));
  const VectorXd found = nonnegative_minimum(to_unit.transpose() * reduced * to_unit, along);
  std::vector<Index> present;
  for (Index i = 0; i < found.size(); ++i)
    if (found[i] > 0.0) present.push_back(i);
  return present;
}

MatrixXd root_of(const CurvePrior& prior, const LawFit& fit) {
  return prior.covariance(fit.size_value(), fit.roughness_value()).llt().matrixL();
}

rig::EvidenceFit fitted(const LawProblem& problem, const rig::ModelError& error, const MatrixXd& root,
                        const rig::Shares& shares) {
  return fit_with_shares(problem.target, side_by_side(problem.responses * root, problem.known), error,
                         shares);
}

/// Size and roughness of the largest evidence, step by step from those of `near`, and the fit of any shape.
LawFit fit_of_any_shape(const LawProblem& problem, const rig::ModelError& error, const CurvePrior& prior,
                        const LawFit& near) {
  // An error as large as the misfit and a curve that makes the misfit are two maxima: searched from both.
  LawFit best = near;
  best.root = root_of(prior, near);
  best.evidence = fitted(problem, error, best.root, near.evidence.shares);
  if (rig::EvidenceFit small = fitted(problem, error, best.root, error.prior.share);
      small.log_evidence > best.evidence.log_evidence)
    best.evidence = std::move(small);
  std::map<std::pair<size_t, size_t>, bool> tried{{{near.size, near.roughness}, true}};
  for (bool moved = true; moved;) {
    moved = false;
    for (const auto& [by_size, by_roughness] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      LawFit there = best;
      there.size += static_cast<size_t>(by_size);  // beyond the first: beyond the last
      there.roughness += static_cast<size_t>(by_roughness);
      if (there.size >= CurvePrior::sizes.size() || there.roughness >= CurvePrior::roughnesses.size() ||
          !tried.try_emplace({there.size, there.roughness}, true).second)
        continue;
      there.root = root_of(prior, there);
      there.evidence = fitted(problem, error, there.root, best.evidence.shares);
      if (there.evidence.log_evidence <= best.evidence.log_evidence) continue;
      best = std::move(there);
      moved = true;
    }
  }
  return best;
}

/// Of the curve's values, with what it may do between the knots.
VectorXd spread_of(const LawFit& fit, const CurvePrior& prior) {
  const Index count = fit.root.cols();
  const MatrixXd posterior =
      fit.evidence.precision.llt().solve(MatrixXd::Identity(fit.evidence.precision.rows(), count));
  const VectorXd square = (fit.root * posterior.topRows(count) * fit.root.transpose()).diagonal();
  return (square.array() + prior.between_knots(fit.size_value(), fit.roughness_value())).sqrt();
}

}  // namespace

LawProblem LawProblem::rows(const std::vector<Index>& rows) const {
  return {target(rows), responses(rows, Eigen::all), known(rows, Eigen::all)};
}

rig::ModelError error_of_rows(const rig::ModelError& error, const std::vector<Index>& rows) {
  rig::ModelError part{error.noise(rows), error.unit(rows), {}, error.prior, error.range};
  for (const Index row : rows)
    part.group.push_back(error.group[static_cast<size_t>(row)]);
  return part;
}

CurvePrior::CurvePrior(CurveShape shape, const std::vector<double>& knots, double scale) : scale_(scale) {
  const bool any_at_rest = shape == CurveShape::resisting;
  const double farthest = std::max(knots.back(), -knots.front());
  std::vector<double> x;
  for (size_t k = 0; k < knots.size(); ++k) {
    const bool is_end = shape == CurveShape::periodic && k + 1 == knots.size();
    if ((knots[k] == 0.0 && !any_at_rest) || is_end) continue;
    free_.push_back(k);
    x.push_back(knots[k] / farthest);
  }
  for (size_t k = 0; k + 1 < knots.size(); ++k)
    widest_ = std::max(widest_, (knots[k + 1] - knots[k]) / farthest);
  const auto count = static_cast<Index>(x.size());
  const auto made = [&](const auto& kernel) {
    MatrixXd matrix(count, count);
    for (Index i = 0; i < count; ++i)
      for (Index j = 0; j < count; ++j)
        matrix(i, j) = kernel(x[static_cast<size_t>(i)], x[static_cast<size_t>(j)]);
    return matrix;
  };
  straight_ = made([&](double a, double b) { return a * b + (any_at_rest ? 1.0 : 0.0); });
  rough_ = made(wiener_kernel);
  if (shape == CurveShape::periodic) {  // nothing at the end, too: straight is nothing
    straight_.setZero();
    rough_ = made([](double a, double b) {
      return wiener_kernel(a, b) + a * b - (wiener_kernel(a, 1.0) + a) * (wiener_kernel(1.0, b) + b) / 2.0;
    });
  }
  if (any_at_rest) increments_ = MatrixXd::Identity(count, count);
  if (shape != CurveShape::passive) return;
  increments_ = made([](double value, double increment) {
    const bool counts = value * increment > 0.0 && std::abs(increment) <= std::abs(value);
    return counts ? std::copysign(1.0, value) : 0.0;
  });
}

double CurvePrior::between_knots(double size, double roughness) const {
  // Of the integrated Wiener process with slopes unknown: h^3 / 48 of its rate, which is 3 / X^3.
  return std::pow(size * scale_, 2) * roughness * std::pow(widest_, 3) / 16.0;
}

MatrixXd CurvePrior::covariance(double size, double roughness) const {
  constexpr double rounding = 1e-9;
  MatrixXd matrix = std::pow(size * scale_, 2) * (straight_ + roughness * rough_);
  matrix.diagonal().array() += rounding * matrix.diagonal().maxCoeff();
  return matrix;
}

LawFit fit_law(const LawProblem& problem, const rig::ModelError& error, const CurvePrior& prior,
               const LawFit& near) {
  LawFit best = fit_of_any_shape(problem, error, prior, near);
  best.sd = spread_of(best, prior);
  if (const MatrixXd& increments = prior.increments(); increments.cols() > 0) {
    const std::vector<Index> present = present_increments(problem, best.evidence, best.root, increments);
    if (present.empty()) {
      best.root.resize(best.root.rows(), 0);
    } else {
      const MatrixXd kept = increments(Eigen::all, present);
      const MatrixXd known = best.root.triangularView<Eigen::Lower>().solve(kept);
      const Eigen::LLT<MatrixXd> information(known.transpose() * known);
      best.root = information.matrixL().solve(kept.transpose()).transpose();
    }
    best.evidence = fitted(problem, error, best.root, best.evidence.shares);
  }
  best.values = best.root * best.evidence.estimate.head(best.root.cols());
  return best;
}

}  // namespace diastole::explain
