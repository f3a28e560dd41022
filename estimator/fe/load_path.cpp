#include "estimator/fe/load_path.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "estimator/fe/newton.hpp"

namespace diastole {
namespace {

/// An equilibrium, and how far along the path it is (0 start, 1 end).
struct Waypoint {
  ElasticState state;
  double reached;
};

/// The state at `next` on the line from `before` through `last`, pressures that are loads included.
ElasticState extrapolated(const Waypoint& before_point, const Waypoint& last_point, double next) {
  const double reach = (next - last_point.reached) / (last_point.reached - before_point.reached);
  const ElasticState& before = before_point.state;
  const ElasticState& last = last_point.state;
  const auto on_line = [reach](double from, double to) { return to + reach * (to - from); };
  ElasticState state = last;
  for (size_t i = 0; i < state.position_mm.size(); ++i)
    state.position_mm[i] = on_line(before.position_mm[i], last.position_mm[i]);
  for (size_t i = 0; i < state.lagrange_pressure_kPa.size(); ++i)
    state.lagrange_pressure_kPa[i] = on_line(before.lagrange_pressure_kPa[i], last.lagrange_pressure_kPa[i]);
  state.pressure_kPa = on_line(before.pressure_kPa, last.pressure_kPa);
  state.chamber_pressure_kPa = on_line(before.chamber_pressure_kPa, last.chamber_pressure_kPa);
  return state;
}

/// The loads on the way from one state to another load.
class LoadLine {
 public:
  LoadLine(const ElasticSystem& system, const ElasticState& start, const Load& load)
      : from_pressure_kPa_(start.pressure_kPa),
        from_tension_kPa_(start.fibre_tension_kPa),
        from_sealing_kPa_(start.sealing_pressure_kPa),
        to_(load),
        open_chamber_(system.chamber() && !system.chamber()->sealed()) {
    if (system.chamber()) to_sealing_kPa_ = system.chamber()->sealing_pressure_kPa;
    if (load.cavity_volume_mL) {
      from_volume_mm3_ = system.cavity_volume_mm3(start);
      to_volume_mm3_ = mm3_per_mL * *load.cavity_volume_mL;
    }
  }

  [[nodiscard]] bool stays() const {
    const bool cavity_stays =
        to_.cavity_volume_mL ? from_volume_mm3_ == to_volume_mm3_ : from_pressure_kPa_ == to_.pressure_kPa;
    return cavity_stays && from_tension_kPa_ == to_.fibre_tension_kPa && from_sealing_kPa_ == to_sealing_kPa_;
  }

  void put_on(ElasticState& state, double reached) const {
    state.held_volume_mm3.reset();
    if (to_.cavity_volume_mL) {
      state.held_volume_mm3 = std::lerp(from_volume_mm3_, to_volume_mm3_, reached);
    } else {
      state.pressure_kPa = std::lerp(from_pressure_kPa_, to_.pressure_kPa, reached);
    }
    state.fibre_tension_kPa = std::lerp(from_tension_kPa_, to_.fibre_tension_kPa, reached);
    state.sealing_pressure_kPa = std::lerp(from_sealing_kPa_, to_sealing_kPa_, reached);
    if (open_chamber_) state.chamber_pressure_kPa = state.sealing_pressure_kPa;
  }

 private:
  static constexpr double mm3_per_mL = 1e3;
  double from_pressure_kPa_;
  double from_tension_kPa_;
  double from_sealing_kPa_;
  double from_volume_mm3_ = 0.0;
  Load to_;
  double to_sealing_kPa_ = 0.0;
  double to_volume_mm3_ = 0.0;
  bool open_chamber_;
};

void record(SolveReport& report, const NewtonResult& attempt) {
  const bool accepted = attempt.reason == SolveReason::converged;
  report.history.push_back({attempt.state.pressure_kPa, accepted, attempt.iterations});
  report.factorisations += attempt.factorisations;
  for (const NewtonIteration& iteration : attempt.iterations)
    report.newton_iterations += 1 + iteration.corrections;
  if (accepted) {
    ++report.load_steps;
    report.reached_pressure_kPa = attempt.state.pressure_kPa;
    report.negative_pivots = attempt.negative_pivots;
  }
}

}  // namespace

Solution follow_load(ElasticSystem& system, const ElasticState& start, const Load& load,
                     const SolveOptions& options, std::shared_ptr<const CondensedFactor> near_by) {
  constexpr size_t easy_iterations = 4;
  const auto begun = std::chrono::steady_clock::now();
  SolveReport report;
  report.reached_pressure_kPa = start.pressure_kPa;
  const LoadLine line(system, start, load);
  double fraction = options.most_load_fraction;
  Waypoint last{start, 0.0};
  std::optional<Waypoint> before;
  report.reason = SolveReason::out_of_steps;
  while (report.history.size() < options.load_step_limit) {
    const double next = std::min(1.0, last.reached + fraction);
    ElasticState guess = before ? extrapolated(*before, last, next) : last.state;
    line.put_on(guess, next);
    report.pressure_unknowns = system.pressure_unknowns(guess);
    NewtonResult attempt = newton_solve(system, guess, options, std::exchange(near_by, nullptr));
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
      report.beyond_law = attempt.beyond_law;
      if (line.stays() || fraction < options.least_load_fraction) {
        report.reason = attempt.reason;
        break;
      }
    }
  }
  if (report.converged()) {
    report.inverted.reset();
    report.beyond_law.reset();
  }
  if (report.load_steps > 0 && (options.check_stability || !system.rim_skew().empty())) {
    const Stability stability = system.stability(last.state);
    report.negative_pivots = stability.negative_pivots;
    report.unstable_motions = stability.unstable_motions;
    report.singular = stability.singular;
  }
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return {std::move(last.state), std::move(report)};
}

}  // namespace diastole
