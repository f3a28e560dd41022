#include "estimator/fit/fit_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "estimator/fit/offset_score.hpp"
#include "estimator/inference/covariance.hpp"
#include "estimator/inference/deleted_residual.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/tail_probability.hpp"

namespace diastole {
namespace {

using inference::BoundSide;
using inference::estimate_covariance;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// Variances of the values, pressures held at their estimates; `excess` as in estimate_errors.
Eigen::VectorXd variances_at_exact_pressure(const JointProblem& problem, const Eigen::MatrixXd& jacobian,
                                            std::vector<bool> is_free, const Eigen::MatrixXd& excess) {
  std::fill(is_free.begin() + problem.values(), is_free.end() - problem.plane_unknowns(), false);
  Eigen::MatrixXd inverse = estimate_covariance(jacobian, is_free).matrix;
  if (problem.robust()) inverse += (inverse * excess * inverse).eval();
  return inverse.diagonal().head(problem.values());
}

EstimatedValue estimated(const inference::Parameter& parameter, double q, BoundSide bound, double variance,
                         double exact_variance) {
  EstimatedValue result{parameter.value(q),           not_a_number,
                        {not_a_number, not_a_number}, not_a_number,
                        bound == BoundSide::lower,    bound == BoundSide::upper};
  if (bound != BoundSide::none) return result;
  const double sd = std::sqrt(variance);
  result.se = standard_error(parameter, q, sd);
  result.se_exact_pressure = standard_error(parameter, q, std::sqrt(exact_variance));
  result.ci95 = interval(parameter, q, inference::normal_95 * sd);
  return result;
}

/// `weighted`: the frame's part of JointProblem::motion_residuals().
EstimatedFrame estimated(const JointProblem::LoadedFrame& frame, const Eigen::VectorXd& weighted,
                         const Eigen::VectorXd& q, const Eigen::MatrixXd& covariance) {
  const auto unknown = frame.pressure_unknown;
  return {.number = frame.number,
          .load = frame.load,
          .pressure_kPa = unknown ? q[*unknown] : frame.load.pressure_kPa,
          .se_kPa = unknown ? std::sqrt(covariance(*unknown, *unknown)) : 0.0,
          .by_motion = {},
          .found = frame.residuals.found(),
          .weighted = weighted,
          .unweighted_mm = weighted.cwiseProduct(frame.residuals.sigmas_mm()),
          .position_mm = frame.position_mm};
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

/// Means of the influence's slope (a) and square (b) over the motion's residuals: the covariance of an M-estimator is b / a^2
/// of a least-squares fit's (Huber, Robust Statistics, 1981, 7.6).
struct InfluenceMeans {
  double slope = 0, square = 0;
};

InfluenceMeans influence_means(const RobustLoss& loss, const Eigen::VectorXd& residuals) {
  constexpr double least_slope = 0.01;  // of the square: a curvature that hardly any residual supports
  InfluenceMeans means;
  for (const double r : residuals) {
    means.slope += loss.influence_slope(r) / static_cast<double>(residuals.size());
    means.square += loss.influence(r) * loss.influence(r) / static_cast<double>(residuals.size());
  }
  means.slope = std::max(means.slope, least_slope * means.square);
  return means;
}

/// The least-squares problem with the gradient and the mean curvature of the cost: J'J is a J'J + P with J of the motion,
/// P of the priors and a the mean slope of a robust loss' influence.
struct LinearisedCost {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals;
  double motion_scale = 1;  ///< of the motion's rows: sqrt(a)
  double spread = 1;        ///< b / a, b the mean square of the influence
};

LinearisedCost linearised(JointProblem& problem, const Eigen::VectorXd& q) {
  LinearisedCost cost{problem.plain_jacobian(q), problem.residuals(q).value()};
  if (!problem.robust()) return cost;
  const Eigen::VectorXd motion = problem.motion_residuals();
  const InfluenceMeans means = influence_means(*problem.robust(), motion);
  cost.motion_scale = std::sqrt(means.slope);
  cost.spread = means.square / means.slope;
  cost.jacobian.topRows(motion.size()) *= cost.motion_scale;
  for (Eigen::Index i = 0; i < motion.size(); ++i)
    cost.residuals[i] = problem.robust()->influence(motion[i]) / cost.motion_scale;
  return cost;
}

/// Variances of all unknowns when the residuals of a patch may be alike, in all frames: H^-1 (sum of g g' + P) H^-1 with the gradient g
/// that each patch pulls with, and P of the priors (clustered covariance: Liang and Zeger, Biometrika 73 (1986) 13).
Eigen::VectorXd variances_of_patches(const LinearisedCost& cost, const Eigen::MatrixXd& inverse,
                                     const std::vector<int>& patches) {
  const auto motion = static_cast<Eigen::Index>(patches.size());
  const Eigen::MatrixXd priors = cost.jacobian.bottomRows(cost.jacobian.rows() - motion);
  Eigen::MatrixXd middle = priors.transpose() * priors;
  std::map<int, Eigen::VectorXd> pulls;
  for (Eigen::Index i = 0; i < motion; ++i) {
    const Eigen::VectorXd pull = cost.jacobian.row(i).transpose() * cost.residuals[i];
    const int patch = patches[static_cast<size_t>(i)];
    if (patch < 0) {
      middle += pull * pull.transpose();
      continue;
    }
    const auto [at, fresh] = pulls.try_emplace(patch, pull);
    if (!fresh) at->second += pull;
  }
  for (const auto& each : pulls)
    middle += each.second * each.second.transpose();
  return (inverse * middle * inverse).diagonal();
}

/// Widens the values' errors where patches pull more than independent residuals would.
void widen_for_patches(FitOutcome& outcome, const JointProblem& problem, const LinearisedCost& cost,
                       const std::vector<bool>& is_free) {
  const std::vector<int> patches = problem.patches();
  if (patches.empty()) return;
  const Eigen::VectorXd variances =
      variances_of_patches(cost, estimate_covariance(cost.jacobian, is_free).matrix, patches);
  for (Eigen::Index i = 0; i < problem.values(); ++i) {
    const double ratio = variances[i] / outcome.covariance(i, i);
    if (!(ratio > 1)) continue;
    outcome.covariance.row(i) *= std::sqrt(ratio);
    outcome.covariance.col(i) *= std::sqrt(ratio);
    outcome.alike = std::max(outcome.alike, std::sqrt(ratio));
  }
}

/// Normal distributions of one unknown, one a step, with the steps' weights.
struct StepMixture {
  std::vector<double> weights, means, deviations;

  [[nodiscard]] double share_below(double x) const {
    double share = 0;
    for (size_t k = 0; k < weights.size(); ++k)
      share += weights[k] * inference::normal_tail((means[k] - x) / deviations[k]);
    return share;
  }
  [[nodiscard]] double quantile(double share) const {
    const auto [least, most] = std::minmax_element(means.begin(), means.end());
    const double reach = 10 * *std::max_element(deviations.begin(), deviations.end());
    double low = *least - reach, high = *most + reach;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (low + high) / 2;
      (share_below(middle) < share ? low : high) = middle;
    }
    return (low + high) / 2;
  }
};

using Intervals = std::map<Eigen::Index, std::array<double, 2>>;

/// The central 95 % of each value of a block. Its mixture over the steps has longer tails than a normal distribution:
/// 1.96 standard deviations would hold more.
void add_intervals(Intervals& intervals, const EvidenceOfStep& evidence, const SmoothBlock& block,
                   const Eigen::MatrixXd& excess) {
  std::vector<Eigen::VectorXd> variances;
  for (const Eigen::MatrixXd& inverse : evidence.covariance)
    variances.emplace_back((inverse + inverse * excess * inverse).diagonal());
  for (Eigen::Index u = block.first; u < block.first + block.differences.cols(); ++u) {
    if (!(variances.front()[u] > 0)) continue;
    StepMixture mixture{evidence.weights, {}, {}};
    for (size_t k = 0; k < evidence.steps.size(); ++k) {
      mixture.means.push_back(evidence.q[k][u]);
      mixture.deviations.push_back(std::sqrt(variances[k][u]));
    }
    intervals[u] = {mixture.quantile(0.025), mixture.quantile(0.975)};
  }
}

/// What the smoothness' own uncertainty adds to the covariance at the chosen steps. Returns the values' intervals where
/// it does.
Intervals estimate_smoothness(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q,
                              const FitOptions& options, const std::vector<bool>& is_free,
                              const Eigen::MatrixXd& excess) {
  Intervals intervals;
  if (options.smooth.empty()) return intervals;
  const QuadraticModel model = quadratic_model(problem, q);
  const Eigen::MatrixXd at_chosen = outcome.covariance;
  const auto determined = [&](const Eigen::MatrixXd& covariance, const SmoothBlock& block) {
    return (covariance * model.hessian).diagonal().segment(block.first, block.differences.cols()).sum();
  };
  for (size_t i = 0; i < options.smooth.size(); ++i) {
    const SmoothBlock& block = problem.smoothness()[i];
    const bool by_evidence = !options.smooth[i].step;
    SmoothOutcome smooth{
        {block.step, by_evidence, false, {block.step, block.step}, determined(at_chosen, block)},
        options.smooth[i].first_value};
    if (smooth.by_evidence) {
      const EvidenceOfStep evidence = evidence_of_step(model, problem.smoothness(), i, is_free);
      smooth.none_seen = evidence.none_seen;
      smooth.step90 = {step_at(evidence, 0.05), step_at(evidence, 0.95)};
      smooth.effective_values = 0;
      add_intervals(intervals, evidence, block, excess);
      for (size_t k = 0; k < evidence.steps.size(); ++k) {
        const Eigen::VectorXd apart = evidence.q[k] - q;
        const Eigen::MatrixXd& inverse = evidence.covariance[k];
        smooth.effective_values += evidence.weights[k] * determined(inverse, block);
        outcome.covariance += evidence.weights[k] *
                              (inverse + inverse * excess * inverse + apart * apart.transpose() - at_chosen);
      }
    }
    outcome.smoothness.push_back(smooth);
  }
  return intervals;
}

/// Adds what the considered errors make the estimate follow: dq = - H^-1 J' c for the change c of the residuals that one standard
/// deviation makes. Returns the variances that each source adds.
std::map<std::string, Eigen::VectorXd> consider_errors(FitOutcome& outcome, JointProblem& problem,
                                                       const LinearisedCost& cost,
                                                       const Eigen::MatrixXd& inverse) {
  std::map<std::string, Eigen::VectorXd> added;
  const Eigen::Index motion = problem.motion_residuals().size();
  for (JointProblem::ConsideredColumn& error : problem.considered_columns()) {
    error.column.head(motion) *= cost.motion_scale;
    const Eigen::VectorXd change = -inverse * (cost.jacobian.transpose() * error.column);
    outcome.covariance += change * change.transpose();
    auto [of_source, is_new] = added.try_emplace(error.source, Eigen::VectorXd::Zero(change.size()));
    of_source->second += change.cwiseAbs2();
  }
  return added;
}

/// `row`: of the frame's reading. `inverse` of the linearised cost, and `variance_factor` of its residuals.
std::optional<PressureByMotion> pressure_by_motion(const Frame& load, const LinearisedCost& cost,
                                                   Eigen::Index row, const Eigen::MatrixXd& inverse,
                                                   double variance_factor) {
  const auto deleted =
      inference::deleted_residual(cost.residuals[row], cost.jacobian.row(row).transpose(), inverse);
  if (!deleted) return std::nullopt;
  const double off = -deleted->value;
  const double variance = std::max(1.0, variance_factor) * (1.0 - deleted->share) / deleted->share;
  return PressureByMotion{load.pressure_kPa - off * load.sigma_kPa, std::sqrt(variance) * load.sigma_kPa,
                          off / std::sqrt(1.0 + variance)};
}

/// Variances of the unknowns' coordinates after each step that adds to them.
struct ErrorParts {
  Eigen::VectorXd exact;          ///< with the pressures held at their estimates
  Eigen::VectorXd of_pressures;   ///< share of the pressures in what the data leave
  Eigen::VectorXd of_smoothness;  ///< data and smoothness
  Eigen::VectorXd of_data;        ///< and patches
  std::map<std::string, Eigen::VectorXd> considered;
  Intervals intervals;
};

/// The values with their errors; rows and columns of the covariance become those of the values from those of their coordinates.
void add_values(FitOutcome& outcome, const JointProblem& problem, const Eigen::VectorXd& q,
                const ErrorParts& parts) {
  for (Eigen::Index i = 0; i < problem.values(); ++i) {
    const inference::Parameter& parameter = problem.space()[i];
    const double variance = outcome.covariance(i, i), pressures = parts.of_pressures[i] * parts.of_data[i];
    outcome.values.push_back(estimated(parameter, q[i], problem.space().bound_under(q, i), variance,
                                       std::isfinite(variance) ? variance - pressures : parts.exact[i]));
    if (variance > 0 && std::isfinite(outcome.values.back().se)) {
      const auto share = [&](const char* source) {
        const auto found = parts.considered.find(source);
        return found == parts.considered.end() ? 0.0 : found->second[i] / variance;
      };
      outcome.values.back().shares = VarianceShares{(parts.of_data[i] - pressures) / variance,
                                                    pressures / variance, share("fibres"), share("geometry")};
    }
    if (const auto found = parts.intervals.find(i); found != parts.intervals.end()) {
      const auto [low, high] = found->second;  // without what patches and considered errors add
      outcome.values.back().ci95 = interval(parameter, (low + high) / 2,
                                            (high - low) / 2 * std::sqrt(variance / parts.of_smoothness[i]));
    }
    const double slope = parameter.slope(q[i]);
    outcome.covariance.row(i) *= slope;
    outcome.covariance.col(i) *= slope;
  }
}

/// The frames with what their tags, whose residuals are `motion`, say of the pressure.
void add_frames(FitOutcome& outcome, const JointProblem& problem, const Eigen::VectorXd& q,
                const Eigen::VectorXd& motion, const LinearisedCost& cost, const Eigen::MatrixXd& curvature,
                double spread) {
  Eigen::Index reading = motion.size(), first = 0;
  for (const JointProblem::LoadedFrame& frame : problem.frames()) {
    const Eigen::Index rows = frame.residuals.size();
    outcome.frames.push_back(estimated(frame, motion.segment(first, rows), q, outcome.covariance));
    first += rows;
    EstimatedFrame& added = outcome.frames.back();
    if (frame.pressure_unknown)
      added.by_motion = pressure_by_motion(frame.load, cost, reading++, curvature, spread);
    else if (outcome.pressure_offset)
      added.pressure_kPa -= outcome.pressure_offset->value_kPa;
  }
}

}  // namespace

QuadraticModel quadratic_model(JointProblem& problem, const Eigen::VectorXd& q) {
  LinearisedCost cost = linearised(problem, q);
  cost.jacobian.conservativeResize(problem.data_rows(), Eigen::NoChange);
  cost.residuals.conservativeResize(problem.data_rows());
  return {q, cost.jacobian.transpose() * cost.residuals, cost.jacobian.transpose() * cost.jacobian};
}

Eigen::VectorXd mean_over_steps(JointProblem& problem, const Eigen::VectorXd& q, const FitOptions& options) {
  Eigen::VectorXd mean = q;
  if (options.smooth.empty()) return mean;
  const QuadraticModel model = quadratic_model(problem, q);
  const std::vector<bool> is_free = problem.space().free_unknowns(q);
  for (size_t i = 0; i < options.smooth.size(); ++i) {
    if (options.smooth[i].step) continue;
    const EvidenceOfStep evidence = evidence_of_step(model, problem.smoothness(), i, is_free);
    for (size_t k = 0; k < evidence.steps.size(); ++k)
      mean += evidence.weights[k] * (evidence.q[k] - q);
  }
  return problem.space().clamped(mean);
}

Eigen::MatrixXd estimate_errors(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q,
                                const FitOptions& options) {
  const std::optional<Eigen::VectorXd> residuals = problem.residuals(q);
  if (!residuals) {
    outcome.termination = inference::Termination::no_solution;
    outcome.reason = "Failed: " + problem.failure() + ".";
    return {};
  }
  const LinearisedCost cost = linearised(problem, q);
  const std::vector<bool> is_free = problem.space().free_unknowns(q);
  outcome.rows = problem.data_rows();
  for (Eigen::Index i = 0; i < problem.unknowns(); ++i)
    outcome.unknown_names.push_back(problem.space()[i].name);
  const Eigen::VectorXd motion = problem.motion_residuals();
  outcome.chi2 =
      motion.squaredNorm() + residuals->segment(motion.size(), outcome.rows - motion.size()).squaredNorm();
  const inference::Covariance curvature = estimate_covariance(cost.jacobian, is_free);
  outcome.covariance = curvature.matrix;
  for (const Eigen::VectorXd& combination : curvature.undetermined)
    outcome.undetermined.push_back(inference::in_words(combination, problem.space()));
  // What the residuals' spread has over the curvature makes the covariance that of an M-estimator,
  // (a J'J + P)^-1 (b J'J + P) (a J'J + P)^-1 (Huber, Robust Statistics, 1981, 7.6).
  Eigen::MatrixXd excess = Eigen::MatrixXd::Zero(q.size(), q.size());
  if (problem.robust()) {
    const Eigen::MatrixXd of_motion = cost.jacobian.topRows(motion.size());
    excess = (cost.spread - 1) * of_motion.transpose() * of_motion;
    const Eigen::MatrixXd inverse = outcome.covariance;
    outcome.covariance = inverse + inverse * excess * inverse;
    outcome.robust = RobustOutcome{*problem.robust(), wild_count(motion)};
  }
  const Eigen::MatrixXd data_jacobian = cost.jacobian.topRows(outcome.rows);
  outcome.unknowns = inference::effective_count(outcome.covariance, data_jacobian);
  const double spread =
      problem.robust() ? cost.spread : outcome.chi2 / (static_cast<double>(outcome.rows) - outcome.unknowns);
  if (!problem.offset_unknown()) {
    Eigen::VectorXd column = problem.offset_column();
    column.head(motion.size()) *= cost.motion_scale;
    outcome.offset_score = offset_score(problem, q, {cost.jacobian, cost.residuals, is_free, spread}, column);
  }
  // Smoothness and patches widen what is known with the pressures and without them alike.
  ErrorParts parts;
  parts.exact = variances_at_exact_pressure(problem, cost.jacobian, is_free, excess);
  parts.of_pressures =
      1.0 -
      parts.exact.cwiseQuotient(outcome.covariance.diagonal().head(parts.exact.size())).array().min(1.0);
  parts.intervals = estimate_smoothness(outcome, problem, q, options, is_free, excess);
  parts.of_smoothness = outcome.covariance.diagonal();
  widen_for_patches(outcome, problem, cost, is_free);
  parts.of_data = outcome.covariance.diagonal();
  parts.considered = consider_errors(outcome, problem, cost, curvature.matrix);
  const Eigen::MatrixXd in_coordinates = outcome.covariance;
  add_values(outcome, problem, q, parts);
  if (const auto offset = problem.offset_unknown())
    outcome.pressure_offset = PressureOffset{q[*offset], std::sqrt(outcome.covariance(*offset, *offset))};
  if (problem.was_imaged_loaded()) {
    const auto unknown = problem.imaged_unknown();
    outcome.imaged_pressure = EstimatedPressure{
        problem.imaged_pressure_at(q), unknown ? std::sqrt(outcome.covariance(*unknown, *unknown)) : 0.0};
  }
  if (problem.work()) outcome.stored_energy_mJ = problem.stored_energy_mJ();
  add_frames(outcome, problem, q, motion, cost, curvature.matrix, spread);
  return in_coordinates;
}

}  // namespace diastole
