#include "estimator/fit/fit.hpp"

#include <chrono>
#include <cmath>
#include <limits>

#include "estimator/fit/uncertainty.hpp"

namespace diastole {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr int most_searches = 3;  // the choice of usable points settles in one or two

std::vector<bool> free_unknowns(const JointProblem& problem, const Eigen::VectorXd& q) {
  std::vector<bool> is_free;
  for (Eigen::Index i = 0; i < q.size(); ++i)
    is_free.push_back(problem.bound_under(q, i) == BoundSide::none);
  return is_free;
}

/// Variances of the values alone, pressures held at their estimates.
Eigen::VectorXd variances_at_exact_pressure(const Eigen::MatrixXd& jacobian, const std::vector<bool>& is_free,
                                            Eigen::Index values) {
  const std::vector<bool> free_values(is_free.begin(), is_free.begin() + values);
  return covariance(jacobian.leftCols(values), free_values).diagonal();
}

EstimatedValue estimated(const SoughtValue& sought, double q, BoundSide bound, double variance,
                         double exact_variance) {
  EstimatedValue result{sought.value(q),
                        not_a_number,
                        {not_a_number, not_a_number},
                        not_a_number,
                        bound == BoundSide::lower,
                        bound == BoundSide::upper};
  if (bound != BoundSide::none) return result;
  const double sd = std::sqrt(variance);
  result.se = sought.slope(q) * sd;
  result.se_exact_pressure = sought.slope(q) * std::sqrt(exact_variance);
  result.ci95 = {sought.value(q - normal_95 * sd), sought.value(q + normal_95 * sd)};
  return result;
}

EstimatedFrame estimated(const JointProblem::LoadedFrame& frame, const Eigen::VectorXd& q,
                         const Eigen::MatrixXd& covariance) {
  const auto unknown = frame.pressure_unknown;
  return {.number = frame.number,
          .load = frame.load,
          .pressure_kPa = unknown ? q[*unknown] : frame.load.pressure_kPa,
          .se_kPa = unknown ? std::sqrt(covariance(*unknown, *unknown)) : 0.0,
          .usable = frame.residuals.usable(),
          .tags_left_out = frame.residuals.tags_left_out(),
          .points_left_out = frame.residuals.points_left_out(),
          .weighted = frame.residuals.weighted(),
          .unweighted_mm = frame.residuals.unweighted_mm(),
          .position_mm = frame.position_mm};
}

void tell_uncertainty(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q) {
  const Eigen::VectorXd* residuals = problem.residuals(q);
  if (residuals == nullptr) {
    outcome.converged = false;
    outcome.reason = "Failed: " + problem.failure() + ".";
    return;
  }
  const Eigen::MatrixXd jacobian = problem.jacobian(q);
  const std::vector<bool> is_free = free_unknowns(problem, q);
  outcome.chi2 = residuals->squaredNorm();
  outcome.rows = residuals->size();
  outcome.unknowns = std::count(is_free.begin(), is_free.end(), true);
  outcome.covariance = covariance(jacobian, is_free);
  const Eigen::VectorXd exact = variances_at_exact_pressure(jacobian, is_free, problem.values());
  for (Eigen::Index i = 0; i < problem.values(); ++i) {
    outcome.values.push_back(
        estimated(problem.value(i), q[i], problem.bound_under(q, i), outcome.covariance(i, i), exact[i]));
    const double slope = problem.value(i).slope(q[i]);
    outcome.covariance.row(i) *= slope;
    outcome.covariance.col(i) *= slope;
  }
  for (const JointProblem::LoadedFrame& frame : problem.frames()) {
    outcome.frames.push_back(estimated(frame, q, outcome.covariance));
  }
}

/// The step with its values in their own units.
OptimiserStep in_own_units(OptimiserStep step, const JointProblem& problem) {
  for (Eigen::Index i = 0; i < problem.values(); ++i)
    step.q[i] = problem.value(i).value(step.q[i]);
  return step;
}

OptimiserResult search_from(JointProblem& problem, const Eigen::VectorXd& q, FitOutcome& outcome,
                            const FitOptions& options) {
  OptimiserOptions settings = options.optimiser;
  settings.on_step = [&](const OptimiserStep& step) {
    // A second search starts where the first ended: its step 0 says nothing new.
    if (step.iteration == 0 && !outcome.history.empty()) return;
    outcome.history.push_back(in_own_units(step, problem));
    outcome.history.back().iteration = static_cast<int>(outcome.history.size()) - 1;
    if (options.on_step) options.on_step(outcome.history.back());
  };
  return minimise(problem, q, settings);
}

}  // namespace

FitOutcome fit_motion(MotionModel& model, const std::vector<SoughtValue>& sought,
                      const Measurement& measurement, const FitOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  FitOutcome outcome;
  JointProblem problem(model, sought, measurement, options.locator);
  Eigen::VectorXd q = problem.start();
  // Which points lie on the body depends on the motion: search again while a better motion finds more of
  // them.
  for (int search = 0; search < most_searches; ++search) {
    const std::optional<size_t> gained = problem.find_points(q);
    if (!gained) {
      outcome.reason = "Failed: " + problem.failure() + ".";
      break;
    }
    if (*gained == 0 && search > 0) break;
    OptimiserResult found = search_from(problem, q, outcome, options);
    q = found.q;
    outcome.converged = found.converged;
    outcome.reason = std::move(found.reason);
    outcome.iterations += found.iterations;
    if (!found.converged) break;
  }
  if (!outcome.history.empty()) tell_uncertainty(outcome, problem, q);
  outcome.forward_solves = problem.forward_solves();
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return outcome;
}

}  // namespace diastole
