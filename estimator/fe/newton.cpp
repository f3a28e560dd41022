#include "estimator/fe/newton.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/fe/condensed_factor.hpp"
#include "estimator/fe/kept_factor.hpp"

namespace diastole {
namespace {

constexpr double least_damping = 0.02;
/// With a kept factor the error is not much smaller than the last correction, as it is with a new tangent.
constexpr double remaining_error = 0.1;
/// With the factor of another tangent corrections shrink more slowly: the error may be ten times the last one.
constexpr double remaining_error_near_by = 1e-3;

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

  /// With the factor of another tangent alone; none if that does not lead to an equilibrium.
  std::optional<NewtonResult> run_with(std::shared_ptr<const CondensedFactor> factor) {
    SystemResidual residual = system_.residual(result_.state);
    if (reason_against(residual)) return {};
    system_.use_factor(std::move(factor));
    remaining_error_ = remaining_error_near_by;
    result_.negative_pivots = system_.equations().pressure_unknowns();
    const std::vector<double> step = correction(residual);
    result_.iterations.push_back({.step = size(step)});
    if (!std::isfinite(result_.iterations.back().step)) return {};
    if (advance(step, residual) != SolveReason::converged) return {};
    if (options_.on_iteration) options_.on_iteration(result_.state.pressure_kPa, result_.iterations.back());
    return finish(SolveReason::converged);
  }

  NewtonResult run() {
    SystemResidual residual = system_.residual(result_.state);
    if (const auto impossible = reason_against(residual)) return finish(*impossible, residual);
    while (result_.iterations.size() < options_.newton_limit) {
      const FactorResult factor = system_.factorise(result_.state);
      ++result_.factorisations;
      if (factor.singular) return finish(SolveReason::singular_tangent);
      result_.negative_pivots = factor.negative_pivots;
      const std::vector<double> step = correction(residual);
      result_.iterations.push_back({.step = size(step)});
      if (!std::isfinite(result_.iterations.back().step)) return finish(SolveReason::singular_tangent);
      const std::optional<SolveReason> ended = advance(step, residual);
      if (options_.on_iteration) options_.on_iteration(result_.state.pressure_kPa, result_.iterations.back());
      if (ended) return finish(*ended, residual);
    }
    return finish(SolveReason::no_convergence);
  }

 private:
  NewtonResult finish(SolveReason reason, const SystemResidual& residual = {}) {
    result_.reason = reason;
    if (reason == SolveReason::inverted_element) result_.inverted = residual.inverted;
    if (reason == SolveReason::beyond_law) result_.beyond_law = residual.beyond_law;
    return std::move(result_);
  }

  /// Why a state is none that the material can be in.
  static std::optional<SolveReason> reason_against(const SystemResidual& residual) {
    if (residual.inverted) return SolveReason::inverted_element;
    if (residual.beyond_law) return SolveReason::beyond_law;
    return {};
  }

  std::vector<double> correction(SystemResidual& residual) {
    std::vector<double> step = std::move(residual.values);
    for (double& value : step)
      value = -value;
    if (const auto condensed = system_.kept_factor()) {
      condensed->solve_roughly(step);
    } else {
      system_.solve(step);
    }
    return step;
  }

  [[nodiscard]] double product(std::span<const double> a, std::span<const double> b) const {
    const size_t displacements = system_.equations().displacement_unknowns();
    const auto mean = [&](size_t from, size_t to) {
      double sum = 0.0;
      for (size_t n = from; n < to; ++n)
        sum += a[n] * b[n];
      return from == to ? 0.0 : sum / static_cast<double>(to - from);
    };
    const double extent = system_.mesh().extent_mm();
    return mean(0, displacements) / (extent * extent) +
           mean(displacements, a.size()) / (pressure_scale_kPa_ * pressure_scale_kPa_);
  }

  [[nodiscard]] double size(std::span<const double> step) const { return std::sqrt(product(step, step)); }

  /// Damps `step` until the simplified correction after it is smaller, takes it, and then corrects with the
  /// same factor while that pays. Leaves the new residual; returns a reason when the iteration is over.
  std::optional<SolveReason> advance(const std::vector<double>& step, SystemResidual& residual) {
    NewtonIteration& iteration = result_.iterations.back();
    double damping = 1.0;
    while (true) {
      const ElasticState trial = system_.moved(result_.state, step, damping);
      SystemResidual after = system_.residual(trial);
      double allowed = 0.5 * damping;
      const std::optional<SolveReason> impossible = reason_against(after);
      if (!impossible) {
        const SystemResidual kept = after;
        const std::vector<double> next = correction(after);
        const double shrunk = size(next);
        if (shrunk <= (1.0 - 0.25 * damping) * iteration.step || shrunk <= options_.tolerance) {
          iteration.damping = damping;
          result_.state = trial;
          residual = kept;
          if (damping < 1.0) return {};
          return correct_with_kept_factor(step, next, residual);
        }
        allowed = std::min(allowed, suggested_damping(step, next, damping, iteration.step));
      }
      damping = std::max(allowed, 0.1 * damping);
      if (damping < least_damping) {
        residual.inverted = after.inverted;
        residual.beyond_law = after.beyond_law;
        return impossible.value_or(SolveReason::no_convergence);
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

  /// `simplified`: the correction that follows `step`.
  std::optional<SolveReason> correct_with_kept_factor(const std::vector<double>& step,
                                                      std::vector<double> simplified,
                                                      SystemResidual& residual) {
    NewtonIteration& iteration = result_.iterations.back();
    KeptFactor factor([this](auto a, auto b) { return product(a, b); }, step);
    while (true) {
      const bool good_enough = size(simplified) <= options_.tolerance;
      std::optional<std::vector<double>> next = factor.next_step(simplified);
      const bool at_rounding = !next && good_enough;
      if (at_rounding) next = std::move(simplified);
      if (!next) return {};
      const ElasticState corrected = system_.moved(result_.state, *next, 1.0);
      SystemResidual after = system_.residual(corrected);
      if (reason_against(after)) return {};
      result_.state = corrected;
      ++iteration.corrections;
      if (at_rounding || size(*next) <= remaining_error_ * options_.tolerance) return SolveReason::converged;
      residual = after;
      simplified = correction(after);
    }
  }

  ElasticSystem& system_;
  const SolveOptions& options_;
  NewtonResult result_;
  double pressure_scale_kPa_ = 1.0;
  double remaining_error_ = remaining_error;
};

}  // namespace

NewtonResult newton_solve(ElasticSystem& system, const ElasticState& guess, const SolveOptions& options,
                          std::shared_ptr<const CondensedFactor> near_by) {
  if (near_by) {
    if (auto result = Newton(system, guess, options).run_with(std::move(near_by))) return *std::move(result);
  }
  return Newton(system, guess, options).run();
}

}  // namespace diastole
