#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/rig_fit/rig_fit.hpp"
#include "estimator/rig_fit/search_scale.hpp"

namespace diastole::rig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double small_gain = 0.01;  ///< of chi-square: not worth a step
constexpr double small_part = 1e-4;  ///< of what is above the noise: the same where a model is wrong
constexpr double far_sigma =
    2.0;  ///< steps in all, after which Broyden's updates are no longer trusted at the end

/// Damped least squares on a Jacobian that is kept by Broyden's updates.
class Search {
 public:
  Search(std::vector<SearchCoordinate> coordinates, std::vector<bool> never)
      : coordinates_(std::move(coordinates)), never_(std::move(never)), held_(never_) {}

  [[nodiscard]] VectorXd clamped(VectorXd at) const {
    for (Index i = 0; i < at.size(); ++i)
      at[i] = std::clamp(at[i], coordinate(i).lower, coordinate(i).upper);
    return at;
  }
  [[nodiscard]] std::vector<double> natural(const VectorXd& at) const {
    std::vector<double> values;
    for (Index i = 0; i < at.size(); ++i)
      values.push_back(from_search(coordinate(i).scale, at[i]));
    return values;
  }
  [[nodiscard]] VectorXd sought(const std::vector<double>& values) const {
    VectorXd at(static_cast<Index>(values.size()));
    for (Index i = 0; i < at.size(); ++i)
      at[i] = to_search(coordinate(i).scale, values[static_cast<size_t>(i)]);
    return clamped(at);
  }
  [[nodiscard]] bool held(Index i) const { return held_[static_cast<size_t>(i)]; }
  [[nodiscard]] double slope(const VectorXd& at, Index i) const {
    return natural_slope(coordinate(i).scale, at[i]);
  }

  /// Normal equations at `at`; unknowns that are pushed against a bound are held.
  void set_normal(const MatrixXd& jacobian, const VectorXd& residuals, const VectorXd& at) {
    normal_.noalias() = jacobian.transpose() * jacobian;
    gradient_.noalias() = jacobian.transpose() * residuals;
    for (Index i = 0; i < at.size(); ++i) {
      held_[static_cast<size_t>(i)] =
          never_[static_cast<size_t>(i)] || (at[i] <= coordinate(i).lower && gradient_[i] > 0.0) ||
          (at[i] >= coordinate(i).upper && gradient_[i] < 0.0) || normal_(i, i) <= 0.0;
    }
  }
  [[nodiscard]] VectorXd step(double damping) const {
    MatrixXd system = free_normal();
    VectorXd right = -gradient_;
    for (Index i = 0; i < right.size(); ++i) {
      if (held(i)) right[i] = 0.0;
      system(i, i) *= 1.0 + damping;
    }
    return system.ldlt().solve(right);
  }
  /// What chi-square loses by a step, as the linear model says.
  [[nodiscard]] double expected_gain(const VectorXd& step) const {
    return -2.0 * gradient_.dot(step) - step.dot(normal_ * step);
  }
  /// Size of a step in standard errors.
  [[nodiscard]] double sigmas(const VectorXd& step) const { return std::sqrt(step.dot(normal_ * step)); }
  [[nodiscard]] MatrixXd covariance() const { return free_normal().inverse(); }
  /// C. G. Broyden's update in the metric of the columns' sizes: the least change that explains what a step did.
  void update(MatrixXd& jacobian, const VectorXd& step, const VectorXd& change) const {
    VectorXd weighted = step.cwiseProduct(normal_.diagonal());
    const double size = step.dot(weighted);
    if (size > 0.0) jacobian.noalias() += (change - jacobian * step) * (weighted / size).transpose();
  }

 private:
  [[nodiscard]] const SearchCoordinate& coordinate(Index i) const {
    return coordinates_[static_cast<size_t>(i)];
  }
  [[nodiscard]] MatrixXd free_normal() const {
    MatrixXd system = normal_;
    for (Index i = 0; i < system.rows(); ++i) {
      if (!held(i)) continue;
      system.row(i).setZero();
      system.col(i).setZero();
      system(i, i) = 1.0;
    }
    return system;
  }
  std::vector<SearchCoordinate> coordinates_;
  std::vector<bool> never_;
  std::vector<bool> held_;
  MatrixXd normal_;
  VectorXd gradient_;
};

/// The terms' values at a size: amplitudes go from neutral (0) to typical (1) and beyond, the others are typical.
/// Empty if a bound is in the way.
std::vector<double> sized(const ModelTerm& term, const RigModel& base, double size) {
  const std::vector<double> neutral = term.effect->neutral(base);
  std::vector<double> values;
  for (size_t j = 0; j < neutral.size(); ++j) {
    const EffectParameter& parameter = term.effect->parameters()[j];
    const bool amplitude =
        j == 0 || (parameter.scale == SearchScale::linear && neutral[j] == 0.0 && parameter.lower == 0.0);
    const double from = to_search(parameter.scale, neutral[j]);
    const double towards = to_search(parameter.scale, parameter.typical);
    values.push_back(amplitude ? from_search(parameter.scale, from + size * (towards - from))
                               : parameter.typical);
    if (!(values.back() >= parameter.lower && values.back() <= parameter.upper)) return {};
  }
  return values;
}

}  // namespace

std::vector<std::vector<double>> RigProblem::starts(const std::vector<ModelTerm>& terms, const RigFit& before,
                                                    size_t& simulations) const {
  constexpr double far_off = 4.0;     // coarse squares a row, when even the best start is not near
  constexpr double farthest = 120.0;  // typical sizes, if no bound is nearer
  const FitRequest coarse{.fidelity = Fidelity::coarse, .runs = {}};
  const MatrixXd known = columns(before.terms, before.values, coarse);
  const Eigen::LDLT<MatrixXd> normal(
      MatrixXd(known.transpose() * known + 1e-9 * MatrixXd::Identity(known.cols(), known.cols())));
  simulations += static_cast<size_t>(known.cols());
  const Search search(search_coordinates(before.terms, before.unknowns),
                      std::vector<bool>(before.values.size(), false));
  std::vector<std::pair<double, std::vector<double>>> tried;
  const auto add = [&](double size) {
    std::vector<double> values = before.values;
    for (size_t i = before.terms.size(); i < terms.size(); ++i) {
      const std::vector<double> more = sized(terms[i], session_.base, size);
      if (more.empty()) return;
      values.insert(values.end(), more.begin(), more.end());
    }
    const VectorXd misfit = residuals(terms, values, coarse);
    ++simulations;
    if (!misfit.allFinite()) return;  // no motion at these values: the cavity is empty, say
    // What was known before follows, as far as it is linear.
    const VectorXd shift = -normal.solve(known.transpose() * misfit);
    const VectorXd at = search.clamped(search.sought(before.values) + shift);
    const std::vector<double> shifted = search.natural(at);
    std::copy(shifted.begin(), shifted.end(), values.begin());
    tried.emplace_back((misfit + known * shift).squaredNorm(), values);
  };
  for (const double size : {0.1, 0.3, 0.6, 1.0, 1.5, 2.5, 4.0, -0.3, -1.0})
    add(size);
  if (tried.empty() ||
      std::min_element(tried.begin(), tried.end())->first > far_off * static_cast<double>(rows_)) {
    for (const double size :
         {0.14, 0.2, 0.25, 0.36, 0.43, 0.51, 0.7, 0.8, 0.9, 1.12, 1.25, 1.37, 1.75, 2.1, 3.0, 3.5})
      add(size);
    const size_t within = tried.size();
    size_t far = 0;
    for (double size = 4.6; size < farthest && tried.size() == within + far; size *= 1.15, ++far)
      add(size);
  }
  if (tried.empty()) add(0.0);
  std::sort(tried.begin(), tried.end());
  std::vector<std::vector<double>> values;
  for (auto& [square, start] : tried)
    values.push_back(std::move(start));
  return values;
}

RigFit RigProblem::fit(const std::vector<ModelTerm>& terms, const RigFit& before) const {
  constexpr double near =
      1.5;  // coarse squares over the first search's, beyond which a second start is tried
  if (terms.size() == before.terms.size()) return fit_from(terms, before.values);
  size_t simulations = 0;
  const auto from = starts(terms, before, simulations);
  RigFit coarse = fit_from(terms, from.front(), Fidelity::coarse);
  size_t iterations = coarse.iterations;
  simulations += coarse.simulations;
  const bool doubtful = coarse.chi_square > near * static_cast<double>(rows_);
  for (size_t other = 1; doubtful && other < std::min<size_t>(from.size(), 3); ++other) {
    RigFit again = fit_from(terms, from[other], Fidelity::coarse);
    iterations += again.iterations;
    simulations += again.simulations;
    if (again.chi_square < coarse.chi_square) coarse = std::move(again);
  }
  RigFit fine = fit_from(terms, coarse.values, Fidelity::fine);
  fine.iterations += iterations;
  fine.simulations += simulations;
  return fine;
}

RigFit RigProblem::fit_from(const std::vector<ModelTerm>& terms, const std::vector<double>& values,
                            const FitRequest& request) const {
  RigFit fit;
  fit.terms = terms;
  fit.unknowns = unknowns(terms);
  fit.count = count_rows(request);
  const auto count = static_cast<Index>(values.size());
  std::vector<bool> never(values.size(), false);
  never[2] = !noise_.channels.contains(Channel::pump);
  const auto coordinates = search_coordinates(terms, fit.unknowns);
  Search search(coordinates, never);
  const auto moving =
      static_cast<size_t>(std::count_if(coordinates.begin(), coordinates.end(),
                                        [](const auto& coordinate) { return !coordinate.sensors_only; }));
  VectorXd at = search.sought(values);
  fit.residuals = residuals(terms, search.natural(at), request);
  fit.simulations = 1;

  double damping = 1e-6;
  double led_sigma = 0.0;  // since the Jacobian was last differenced
  size_t refused = 0;
  const auto difference = [&] {
    fit.jacobian = columns(terms, search.natural(at), request);
    fit.simulations += moving + 1;
    led_sigma = 0.0;
  };
  difference();
  while (!fit.converged && fit.iterations < options_.most_iterations) {
    ++fit.iterations;
    search.set_normal(fit.jacobian, fit.residuals, at);
    const double before = fit.residuals.squaredNorm();
    const double worth = small_gain + small_part * std::max(before - static_cast<double>(fit.count), 0.0);
    if (search.expected_gain(search.step(0.0)) < worth) {
      if (led_sigma < far_sigma) break;
      difference();
      search.set_normal(fit.jacobian, fit.residuals, at);
    }
    const VectorXd next = search.clamped(at + search.step(damping));
    const VectorXd step = next - at;
    const bool sound = next.allFinite();
    const VectorXd tried = sound ? residuals(terms, search.natural(next), request) : fit.residuals;
    ++fit.simulations;
    const double gain = sound ? before - tried.squaredNorm() : std::nan("");
    const double expected = search.expected_gain(step);
    if (std::isfinite(gain) && gain >= 0.0) {
      fit.converged = led_sigma == 0.0 && gain < worth;
      search.update(fit.jacobian, step, tried - fit.residuals);
      led_sigma += search.sigmas(step);
      at = next;
      fit.residuals = tried;
      refused = 0;
      damping = gain > 0.5 * expected ? std::max(damping * 0.1, 1e-9) : damping;
      if (gain < 0.25 * expected && !fit.converged) difference();
    } else if (led_sigma > 0.0) {
      difference();
    } else {
      damping = std::max(damping * 30.0, 1e-4);
      fit.converged = ++refused > 8;
    }
  }
  fit.converged = fit.converged || fit.iterations < options_.most_iterations;
  search.set_normal(fit.jacobian, fit.residuals, at);
  fit.values = search.natural(at);
  fit.chi_square = fit.residuals.squaredNorm();
  const MatrixXd covariance = search.covariance();
  for (Index i = 0; i < count; ++i) {
    const double error = std::abs(search.slope(at, i)) * std::sqrt(std::max(covariance(i, i), 0.0));
    fit.errors.push_back(search.held(i) ? 0.0 : error);
  }
  return fit;
}

}  // namespace diastole::rig
