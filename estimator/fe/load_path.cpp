#include "estimator/fe/load_path.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "estimator/fe/newton.hpp"

namespace diastole {
namespace {

/// The state at `pressure_kPa` on the line from `before` through `last`.
ElasticState extrapolated(const ElasticState& before, const ElasticState& last, double pressure_kPa) {
  const double reach = (pressure_kPa - last.pressure_kPa) / (last.pressure_kPa - before.pressure_kPa);
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
  report.newton_iterations += attempt.iterations.size();
  for (const NewtonIteration& iteration : attempt.iterations)
    report.corrections += iteration.corrections;
  if (accepted) {
    ++report.load_steps;
    report.reached_pressure_kPa = attempt.state.pressure_kPa;
    report.negative_pivots = attempt.negative_pivots;
  }
}

}  // namespace

PathResult follow_load(ElasticSystem& system, const ElasticState& start, double pressure_kPa,
                       const SolveOptions& options) {
  constexpr size_t easy_iterations = 4;
  const auto begun = std::chrono::steady_clock::now();
  PathResult path{start, {}};
  SolveReport& report = path.report;
  report.pressure_unknowns = system.equations().pressure_unknowns();
  report.reached_pressure_kPa = start.pressure_kPa;
  const double whole = pressure_kPa - start.pressure_kPa;
  double fraction = options.most_load_fraction;
  double reached = 0.0;
  std::optional<ElasticState> before;
  report.reason = SolveReason::out_of_steps;
  while (report.history.size() < options.load_step_limit) {
    const double next = std::min(1.0, reached + fraction);
    const double next_kPa = next == 1.0 ? pressure_kPa : start.pressure_kPa + next * whole;
    ElasticState guess = before ? extrapolated(*before, path.state, next_kPa) : path.state;
    guess.pressure_kPa = next_kPa;
    NewtonResult attempt = newton_solve(system, guess, options);
    record(report, attempt);
    if (attempt.reason == SolveReason::converged) {
      if (reached > 0.0 || path.state.pressure_kPa != next_kPa) before = std::move(path.state);
      path.state = std::move(attempt.state);
      reached = next;
      if (reached == 1.0) {
        report.reason = SolveReason::converged;
        break;
      }
      if (attempt.iterations.size() <= easy_iterations)
        fraction = std::min(2.0 * fraction, options.most_load_fraction);
    } else {
      fraction *= 0.5;
      report.inverted = attempt.inverted;
      if (whole == 0.0 || fraction < options.least_load_fraction) {
        report.reason = attempt.reason;
        break;
      }
    }
  }
  if (report.converged()) report.inverted.reset();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return path;
}

}  // namespace diastole
