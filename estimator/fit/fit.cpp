#include "estimator/fit/fit.hpp"

#include <chrono>
#include <cmath>
#include <limits>

#include "estimator/fit/uncertainty.hpp"

namespace diastole {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
// The choice of usable points settles in one or two searches, that of the smoothness in two or three.
constexpr int most_searches = 6;
constexpr double first_step = 0.1;        // of smooth values, until the data say better
constexpr double rough_tolerance = 1e-3;  // of the cost, in the search that only prepares the smoothness

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

std::vector<SmoothBlock> smooth_blocks(const MotionModel& model, const FitOptions& options) {
  std::vector<SmoothBlock> blocks;
  for (const SmoothRegion& region : options.smooth) {
    blocks.push_back({static_cast<Eigen::Index>(region.first_value), neighbour_differences(model.mesh()),
                      region.step.value_or(first_step)});
  }
  return blocks;
}

bool any_by_evidence(const FitOptions& options) {
  return std::any_of(options.smooth.begin(), options.smooth.end(),
                     [](const SmoothRegion& region) { return !region.step; });
}

/// Of the data alone, at q. Precondition: `residuals(q)` succeeded just before.
QuadraticModel quadratic_model(JointProblem& problem, const Eigen::VectorXd& q) {
  const Eigen::VectorXd residuals = problem.residuals(q)->head(problem.data_rows());
  const Eigen::MatrixXd jacobian = problem.jacobian(q).topRows(problem.data_rows());
  return {q, jacobian.transpose() * residuals, jacobian.transpose() * jacobian};
}

/// Gives each block the step of greatest evidence; whether one changed.
bool choose_smoothness(JointProblem& problem, const Eigen::VectorXd& q, const FitOptions& options) {
  if (!any_by_evidence(options) || problem.residuals(q) == nullptr) return false;
  const QuadraticModel model = quadratic_model(problem, q);
  std::vector<SmoothBlock> blocks = problem.smoothness();
  bool changed = false;
  for (size_t i = 0; i < blocks.size(); ++i) {
    if (options.smooth[i].step) continue;
    const double step = evidence_of_step(model, blocks, i, free_unknowns(problem, q)).step;
    changed = changed || step != blocks[i].step;
    blocks[i].step = step;
  }
  if (changed) problem.set_smoothness(std::move(blocks));
  return changed;
}

/// Smallest step below which the given share of the posterior lies.
double step_at(const EvidenceOfStep& evidence, double share) {
  double sum = 0;
  for (size_t i = 0; i < evidence.steps.size(); ++i) {
    sum += evidence.weights[i];
    if (sum >= share) return evidence.steps[i];
  }
  return evidence.steps.back();
}

/// What the smoothness' own uncertainty adds to the covariance at the chosen steps.
void tell_smoothness(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q,
                     const FitOptions& options, const std::vector<bool>& is_free) {
  if (options.smooth.empty()) return;
  const QuadraticModel model = quadratic_model(problem, q);
  const Eigen::MatrixXd at_chosen = outcome.covariance;
  const Eigen::MatrixXd seen = at_chosen * model.hessian;
  for (size_t i = 0; i < options.smooth.size(); ++i) {
    const SmoothBlock& block = problem.smoothness()[i];
    SmoothOutcome told{options.smooth[i].first_value, block.step, !options.smooth[i].step, false,
                       {block.step, block.step},
                       seen.diagonal().segment(block.first, block.differences.cols()).sum()};
    if (told.by_evidence) {
      const EvidenceOfStep evidence = evidence_of_step(model, problem.smoothness(), i, is_free);
      told.none_seen = evidence.none_seen;
      told.step90 = {step_at(evidence, 0.05), step_at(evidence, 0.95)};
      for (size_t k = 0; k < evidence.steps.size(); ++k) {
        const Eigen::VectorXd apart = evidence.q[k] - q;
        outcome.covariance +=
            evidence.weights[k] * (evidence.covariance[k] + apart * apart.transpose() - at_chosen);
      }
    }
    outcome.smoothness.push_back(told);
  }
}

void tell_uncertainty(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q,
                      const FitOptions& options) {
  const Eigen::VectorXd* residuals = problem.residuals(q);
  if (residuals == nullptr) {
    outcome.converged = false;
    outcome.reason = "Failed: " + problem.failure() + ".";
    return;
  }
  const Eigen::MatrixXd jacobian = problem.jacobian(q);
  const std::vector<bool> is_free = free_unknowns(problem, q);
  outcome.rows = problem.data_rows();
  outcome.chi2 = residuals->head(outcome.rows).squaredNorm();
  outcome.covariance = covariance(jacobian, is_free);
  const Eigen::MatrixXd data_jacobian = jacobian.topRows(outcome.rows);
  outcome.unknowns = effective_count(outcome.covariance, data_jacobian);
  tell_smoothness(outcome, problem, q, options, is_free);
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
                            const FitOptions& options, bool roughly) {
  OptimiserOptions settings = options.optimiser;
  if (roughly) settings.cost_tolerance = rough_tolerance;
  settings.iterations_before = outcome.iterations;
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
  problem.set_smoothness(smooth_blocks(model, options));
  // Which points lie on the body depends on the motion, and how smooth the values are depends on the data: search
  // again while a better motion finds more points or another smoothness.
  for (int search = 0; search < most_searches; ++search) {
    const std::optional<size_t> gained = problem.find_points(q);
    if (!gained) {
      outcome.reason = "Failed: " + problem.failure() + ".";
      break;
    }
    const bool roughly = search == 0 && any_by_evidence(options);
    const bool prepared = search == 1 && any_by_evidence(options);
    const bool other_smoothness = search > 0 && choose_smoothness(problem, q, options);
    if (*gained == 0 && !other_smoothness && !prepared && search > 0) break;
    OptimiserResult found = search_from(problem, q, outcome, options, roughly);
    q = found.q;
    outcome.converged = found.converged;
    outcome.reason = std::move(found.reason);
    outcome.iterations += found.iterations;
    if (!found.converged) break;
  }
  if (!outcome.history.empty()) tell_uncertainty(outcome, problem, q, options);
  outcome.forward_solves = problem.forward_solves();
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return outcome;
}

}  // namespace diastole
