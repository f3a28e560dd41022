#include "estimator/fe/pressure_volume.hpp"

#include <optional>
#include <utility>

#include "estimator/fe/elastic_system.hpp"

namespace diastole {
namespace {

/// Where the cubic Hermite through two points of the curve has its extremum, if their slopes have different signs.
std::optional<LimitPoint> limit_between(const PressureVolumePoint& from, const PressureVolumePoint& to) {
  if ((from.stiffness_kPa_per_mL > 0.0) == (to.stiffness_kPa_per_mL > 0.0)) return {};
  const double width_mL = to.volume_change_mL - from.volume_change_mL;
  const double rise = to.pressure_kPa - from.pressure_kPa;
  const double first = width_mL * from.stiffness_kPa_per_mL;
  const double last = width_mL * to.stiffness_kPa_per_mL;
  const double square = 3.0 * rise - 2.0 * first - last;
  const double cube = first + last - 2.0 * rise;
  // first + 2 square t + 3 cube t^2 changes its sign once between 0 and 1.
  double low = 0.0;
  double high = 1.0;
  while (high - low > 1e-12) {
    const double t = 0.5 * (low + high);
    const bool as_first = ((first + t * (2.0 * square + 3.0 * t * cube)) > 0.0) == (first > 0.0);
    (as_first ? low : high) = t;
  }
  return LimitPoint{from.volume_change_mL + low * width_mL,
                    from.pressure_kPa + low * (first + low * (square + low * cube))};
}

/// Where the next equal step leads if the shape goes on as from `before` to `last`.
ElasticState extrapolated(const ElasticState& before, const ElasticState& last) {
  ElasticState next = last;
  next.pressure_kPa += last.pressure_kPa - before.pressure_kPa;
  for (size_t i = 0; i < next.position_mm.size(); ++i)
    next.position_mm[i] += last.position_mm[i] - before.position_mm[i];
  for (size_t i = 0; i < next.lagrange_pressure_kPa.size(); ++i)
    next.lagrange_pressure_kPa[i] += last.lagrange_pressure_kPa[i] - before.lagrange_pressure_kPa[i];
  return next;
}

}  // namespace

double PressureVolumeCurve::work_mJ() const {
  double work = 0.0;
  for (size_t n = 1; n < points.size(); ++n) {
    const PressureVolumePoint& from = points[n - 1];
    const PressureVolumePoint& to = points[n];
    const double width_mL = to.volume_change_mL - from.volume_change_mL;
    work += width_mL * (0.5 * (from.pressure_kPa + to.pressure_kPa) +
                        width_mL * (from.stiffness_kPa_per_mL - to.stiffness_kPa_per_mL) / 12.0);
  }
  return work;
}

PressureVolumeCurve pressure_volume_curve(ElasticModel& model, const PressureVolumeOptions& options) {
  const double rest_mL = model.cavity_volume_mL(model.rest_state());
  PressureVolumeCurve curve;
  curve.state = model.rest_state();
  ElasticState start = curve.state;
  for (size_t step = 0; step <= options.steps; ++step) {
    const double change_mL =
        options.volume_change_mL * static_cast<double>(step) / static_cast<double>(options.steps);
    Load load = options.load;
    load.cavity_volume_mL = rest_mL + change_mL;
    Solution solution = model.solve(load, start);
    curve.last = std::move(solution.report);
    if (!curve.last.converged()) break;
    start = step == 0 ? solution.state : extrapolated(curve.state, solution.state);
    curve.state = std::move(solution.state);
    PressureVolumePoint point{.volume_change_mL = change_mL, .pressure_kPa = curve.state.pressure_kPa};
    const std::optional<double> stiffness = model.cavity_stiffness_kPa_per_mL(curve.state);
    if (!stiffness) {
      curve.last.reason = SolveReason::singular_tangent;
      break;
    }
    point.stiffness_kPa_per_mL = *stiffness;
    point.stored_energy_mJ = model.stored_energy_mJ(curve.state);
    if (options.judge_stability) point.stable_at_volume = model.system().stability(curve.state).stable();
    point.newton_iterations = curve.last.newton_iterations;
    if (!curve.points.empty()) {
      if (const auto limit = limit_between(curve.points.back(), point)) curve.limits.push_back(*limit);
    }
    curve.points.push_back(point);
    if (options.on_point && !options.on_point(point)) break;
  }
  return curve;
}

}  // namespace diastole
