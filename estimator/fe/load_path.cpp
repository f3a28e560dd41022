#include "estimator/fe/load_path.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "estimator/fe/newton.hpp"

namespace diastole {
namespace {

/// An equilibrium, and how far along the path it is (0 start, 1 end).
struct Waypoint {
  ElasticState state;
  double reached;
};

/// The state at `next` on the line from `before` through `last`.
ElasticState extrapolated(const Waypoint& before_point, const Waypoint& last_point, double next) {
  const double reach = (next - last_point.reached) / (last_point.reached - before_point.reached);
  const ElasticState& before = before_point.state;
  const ElasticState& last = last_point.state;
  ElasticState state = last;
  for (size_t i = 0; i < state.position_mm.size(); ++i) {
    state.position_mm[i] += reach * (last.position_mm[i] - before.position_mm[i]);
  }
  for (size_t i = 0; i < state.lagrange_pressure_kPa.size(); ++i) {
    state.lagrange_pressure_kPa[i] +=
        reach * (last.lagrange_pressure_kPa[i] - before.lagrange_pressure_kPa[i]);
  }
  return state;
}

void record(SolveReport& report, const NewtonResult& attempt) {
  const bool accepted = attempt.reason == SolveReason::converged;
  report.history.push_back({attempt.state.pressure_kPa, accepted, attempt.iterations});
  report.factorisations += attempt.iterations.size();
  for (const NewtonIteration& iteration : attempt.iterations)
    report.newton_iterations += 1 + iteration.corrections;
  if (accepted) {
    ++report.load_steps;
    report.reached_pressure_kPa = attempt.state.pressure_kPa;
    report.negative_pivots = attempt.negative_pivots;
  }
}

}  // namespace

PathResult follow_load(ElasticSystem& system, const ElasticState& start, const Load& load,
                       const SolveOptions& options) {
  constexpr size_t easy_iterations = 4;
  const auto begun = std::chrono::steady_clock::now();
  SolveReport report;
  report.pressure_unknowns = system.equations().pressure_unknowns();
  report.reached_pressure_kPa = start.pressure_kPa;
  const bool stays =
      load.pressure_kPa == start.pressure_kPa && load.fibre_tension_kPa == start.fibre_tension_kPa;
  double fraction = options.most_load_fraction;
  Waypoint last{start, 0.0};
  std::optional<Waypoint> before;
  report.reason = SolveReason::out_of_steps;
  while (report.history.size() < options.load_step_limit) {
    const double next = std::min(1.0, last.reached + fraction);
    ElasticState guess = before ? extrapolated(*before, last, next) : last.state;
    guess.pressure_kPa = std::lerp(start.pressure_kPa, load.pressure_kPa, next);
    guess.fibre_tension_kPa = std::lerp(start.fibre_tension_kPa, load.fibre_tension_kPa, next);
    NewtonResult attempt = newton_solve(system, guess, options);
    record(report, attempt);
    if (attempt.reason == SolveReason::converged) {
      before = std::exchange(last, {std::move(attempt.state), next});
      if (next == 1.0) {
        report.reason = SolveReason::converged;
        break;
      }
      if (attempt.iterations.size() <= easy_iterations)
        fraction = std::min(2.0 * fraction, options.most_load_fraction);
    } else {
      fraction *= 0.5;
      report.inverted = attempt.inverted;
      if (stays || fraction < options.least_load_fraction) {
        report.reason = attempt.reason;
        break;
      }
    }
  }
  if (report.converged()) report.inverted.reset();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return {std::move(last.state), std::move(report)};
}

}  // namespace diastole
