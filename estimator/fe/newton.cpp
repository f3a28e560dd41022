#include "estimator/fe/newton.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace diastole {
namespace {

constexpr double least_damping = 0.02;
constexpr double keep_factor_contraction = 0.2;

class Newton {
 public:
  Newton(ElasticSystem& system, const ElasticState& guess, const SolveOptions& options)
      : system_(system), options_(options) {
    result_.state = guess;
    double sum = 0.0;
    for (const double p : guess.lagrange_pressure_kPa)
      sum += p * p;
    constexpr double least_scale_kPa = 1e-3;
    pressure_scale_kPa_ =
        std::max({std::sqrt(sum / static_cast<double>(guess.lagrange_pressure_kPa.size())), least_scale_kPa,
                  std::abs(guess.pressure_kPa), std::abs(guess.chamber_pressure_kPa)});
  }

  NewtonResult run() {
    SystemResidual residual = system_.residual(result_.state);
    if (residual.inverted) return finish(SolveReason::inverted_element, residual.inverted);
    while (result_.iterations.size() < options_.newton_limit) {
      const FactorResult factor = system_.factorise(result_.state);
      if (factor.singular) return finish(SolveReason::singular_tangent);
      result_.negative_pivots = factor.negative_pivots;
      const std::vector<double> step = correction(residual);
      result_.iterations.push_back({.step = size(step)});
      if (!std::isfinite(result_.iterations.back().step)) return finish(SolveReason::singular_tangent);
      const std::optional<SolveReason> ended = advance(step, residual);
      if (options_.on_iteration) options_.on_iteration(result_.state.pressure_kPa, result_.iterations.back());
      if (ended) return finish(*ended, residual.inverted);
    }
    return finish(SolveReason::no_convergence);
  }

 private:
  NewtonResult finish(SolveReason reason, std::optional<InvertedPlace> inverted = {}) {
    result_.reason = reason;
    if (reason == SolveReason::inverted_element) result_.inverted = inverted;
    if (reason == SolveReason::converged && !system_.rim_skew().empty())
      result_.negative_pivots = system_.negative_pivots(result_.state);
    return std::move(result_);
  }

  std::vector<double> correction(SystemResidual& residual) {
    std::vector<double> step = std::move(residual.values);
    for (double& value : step)
      value = -value;
    system_.solve(step);
    return step;
  }

  [[nodiscard]] double size(std::span<const double> step) const {
    const size_t displacements = system_.equations().displacement_unknowns();
    const auto mean_square = [](std::span<const double> part) {
      double sum = 0.0;
      for (const double value : part)
        sum += value * value;
      return part.empty() ? 0.0 : sum / static_cast<double>(part.size());
    };
    const double extent = system_.mesh().extent_mm();
    return std::sqrt(mean_square(step.first(displacements)) / (extent * extent) +
                     mean_square(step.subspan(displacements)) / (pressure_scale_kPa_ * pressure_scale_kPa_));
  }

  /// Damps `step` until the simplified correction after it is smaller, takes it, and then corrects with the
  /// same factor while that pays. Leaves the new residual; returns a reason when the iteration is over.
  std::optional<SolveReason> advance(const std::vector<double>& step, SystemResidual& residual) {
    NewtonIteration& iteration = result_.iterations.back();
    double damping = 1.0;
    while (true) {
      const ElasticState trial = system_.moved(result_.state, step, damping);
      SystemResidual after = system_.residual(trial);
      double allowed = 0.5 * damping;
      if (!after.inverted) {
        const SystemResidual kept = after;
        const std::vector<double> next = correction(after);
        const double shrunk = size(next);
        if (shrunk <= (1.0 - 0.25 * damping) * iteration.step || shrunk <= options_.tolerance) {
          iteration.damping = damping;
          result_.state = trial;
          residual = kept;
          if (damping < 1.0) return {};
          return correct_with_kept_factor(next, iteration.step, residual);
        }
        allowed = std::min(allowed, suggested_damping(step, next, damping, iteration.step));
      }
      damping = std::max(allowed, 0.1 * damping);
      if (damping < least_damping) {
        residual.inverted = after.inverted;
        return after.inverted ? SolveReason::inverted_element : SolveReason::no_convergence;
      }
    }
  }

  /// The damping at which a quadratic model of the error halves the correction.
  [[nodiscard]] double suggested_damping(const std::vector<double>& step, const std::vector<double>& next,
                                         double damping, double step_size) const {
    std::vector<double> bend(step.size());
    for (size_t i = 0; i < step.size(); ++i)
      bend[i] = next[i] - (1.0 - damping) * step[i];
    return 0.5 * step_size * damping * damping / size(bend);
  }

  std::optional<SolveReason> correct_with_kept_factor(std::vector<double> next, double previous,
                                                      SystemResidual& residual) {
    NewtonIteration& iteration = result_.iterations.back();
    while (true) {
      const double current = size(next);
      const bool good_enough = current <= options_.tolerance;
      if (!good_enough && current > keep_factor_contraction * previous) return {};
      const ElasticState corrected = system_.moved(result_.state, next, 1.0);
      SystemResidual after = system_.residual(corrected);
      if (after.inverted) return {};
      result_.state = corrected;
      ++iteration.corrections;
      if (good_enough) return SolveReason::converged;
      residual = after;
      previous = current;
      next = correction(after);
    }
  }

  ElasticSystem& system_;
  const SolveOptions& options_;
  NewtonResult result_;
  double pressure_scale_kPa_ = 1.0;
};

}  // namespace

NewtonResult newton_solve(ElasticSystem& system, const ElasticState& guess, const SolveOptions& options) {
  return Newton(system, guess, options).run();
}

}  // namespace diastole
