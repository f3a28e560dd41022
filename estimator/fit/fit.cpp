#include "estimator/fit/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <set>

#include "estimator/fit/fit_errors.hpp"
#include "estimator/fit/usable_points.hpp"
#include "estimator/inference/profile.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole {
namespace {

using inference::Termination;

constexpr double least_wild = 3.0;        // residuals; chance makes one in two million
constexpr double wild_share = 0.001;      // of all residuals
constexpr double scale_tolerance = 0.02;  // of the robust loss' scale
constexpr double first_step = 0.1;        // of smooth values, until the data say better
constexpr double rough_tolerance = 1e-3;  // of the cost, in the search that only prepares the smoothness

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

using Steps = std::vector<double>;

Steps steps_of(const std::vector<SmoothBlock>& blocks) {
  Steps steps;
  std::ranges::transform(blocks, std::back_inserter(steps), &SmoothBlock::step);
  return steps;
}

/// Gives each block the step of greatest evidence; whether one changed. Steps of `before`, with which searches on the same points and loss
/// ended elsewhere, do not count: two neighbours on the grid may each speak for the other, and fit alike.
bool choose_smoothness(JointProblem& problem, const Eigen::VectorXd& q, const FitOptions& options,
                       std::set<Steps>& before) {
  if (!any_by_evidence(options) || !problem.residuals(q)) return false;
  const QuadraticModel model = quadratic_model(problem, q);
  std::vector<SmoothBlock> blocks = problem.smoothness();
  before.insert(steps_of(blocks));
  for (size_t i = 0; i < blocks.size(); ++i)
    if (!options.smooth[i].step)
      blocks[i].step = evidence_of_step(model, blocks, i, problem.space().free_unknowns(q)).step;
  if (before.contains(steps_of(blocks))) return false;
  problem.set_smoothness(std::move(blocks));
  return true;
}

/// Whether a better loss was chosen: robust where wild points ask for it, with the scale that the residuals have.
bool choose_loss(JointProblem& problem, const FitOptions& options) {
  const Eigen::VectorXd residuals = problem.motion_residuals();
  if (!problem.robust()) {
    const double wild = static_cast<double>(wild_count(residuals));
    if (options.robustness != Robustness::if_needed ||
        wild <= std::max(least_wild, wild_share * static_cast<double>(residuals.size()))) {
      return false;
    }
  }
  const double before = problem.robust() ? problem.robust()->scale : 0.0;
  const RobustLoss loss = RobustLoss::for_deviation(core_deviation(residuals));
  if (std::abs(loss.scale - before) < scale_tolerance * before) return false;
  problem.set_robust(loss);
  return true;
}

/// The step with its values in their own units.
inference::SearchStep in_own_units(inference::SearchStep step, const JointProblem& problem) {
  for (Eigen::Index i = 0; i < problem.values(); ++i)
    step.q[i] = problem.space()[i].value(step.q[i]);
  return step;
}

/// Searches from q on, to where it ended, and keeps how.
void search_from(JointProblem& problem, Eigen::VectorXd& q, FitOutcome& outcome, const FitOptions& options,
                 bool roughly) {
  inference::SearchOptions settings = options.search;
  if (roughly) settings.cost_tolerance = rough_tolerance;
  settings.iterations_before = outcome.iterations;
  settings.on_step = [&](const inference::SearchStep& step) {
    // A second search starts where the first ended: its step 0 says nothing new.
    if (step.iteration == 0 && !outcome.history.empty()) return;
    outcome.history.push_back(in_own_units(step, problem));
    outcome.history.back().iteration = static_cast<int>(outcome.history.size()) - 1;
    if (options.on_step) options.on_step(outcome.history.back());
  };
  inference::SearchResult found = inference::minimise(problem, q, settings);
  q = std::move(found.q);
  outcome.termination = found.termination;
  outcome.reason = std::move(found.reason);
  outcome.iterations += found.iterations;
}

/// What a search rests on beside the unknowns: which points lie on the body depends on the motion, how smooth the values are and how wild
/// residuals are on the data. Chosen anew at q; returns whether something is other than it was, nothing where the model has no solution.
std::optional<bool> choose_anew(JointProblem& problem, const Eigen::VectorXd& q, const FitOptions& options,
                                std::set<Steps>& steps_before) {
  const std::optional<size_t> gained = problem.find_points(q);
  if (!gained) return {};
  if (*gained > 0) steps_before.clear();
  const bool other_smoothness = choose_smoothness(problem, q, options, steps_before);
  const bool other_loss = problem.residuals(q) && choose_loss(problem, options);
  if (other_loss) steps_before.clear();
  return *gained > 0 || other_smoothness || other_loss;
}

void conclude(FitOutcome& outcome, Termination termination, std::string reason) {
  outcome.termination = termination;
  outcome.reason = std::move(reason);
}

/// Searches again and again, until what a search rests on is the same where it ended.
void search_until_same(JointProblem& problem, Eigen::VectorXd& q, FitOutcome& outcome,
                       const FitOptions& options) {
  if (!problem.find_points(q))
    return conclude(outcome, Termination::no_solution, "Failed: " + problem.failure() + ".");
  require_any_usable(problem, options.file);
  const bool prepares = any_by_evidence(options);  // the first search, for the choice of the smoothness
  std::set<Steps> steps_before;
  for (int search = 1;; ++search) {
    search_from(problem, q, outcome, options, search == 1 && prepares);
    const bool stalled = outcome.termination == Termination::stalled;
    if (!outcome.converged() && !stalled) return;
    // Tags that come and go from trial to trial make the cost jump: without them it goes on. So do wild ones that change
    // sides: under a loss that hardly feels them it goes on, too, if the residuals ask for one.
    const bool lost = stalled && problem.give_up_lost() > 0;
    if (stalled) steps_before.clear();
    const std::optional<bool> is_other = choose_anew(problem, q, options, steps_before);
    if (!is_other) return conclude(outcome, Termination::no_solution, "Failed: " + problem.failure() + ".");
    if (!*is_other && !lost && !(search == 1 && prepares)) return;
    if (search == options.most_searches)
      return conclude(outcome, Termination::iteration_limit,
                      fmt::format("Stopped after {} searches: where the last one ended other points lie on "
                                  "the body, or another smoothness or loss fits.",
                                  search));
  }
}

bool is_interrupted(const FitOptions& options) {
  return options.search.interrupted && options.search.interrupted();
}

void estimate_profiles(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q,
                       const Eigen::MatrixXd& covariance, const FitOptions& options) {
  const std::optional<Eigen::VectorXd> residuals = problem.residuals(q);
  if (!residuals) return;
  const double cost = residuals->squaredNorm() / 2;
  for (const size_t place : options.profiled) {
    if (is_interrupted(options)) {
      outcome.interrupted = "profile";
      return;
    }
    const auto which = static_cast<Eigen::Index>(place);
    if (problem.space().bound_under(q, which) != inference::BoundSide::none ||
        !std::isfinite(covariance(which, which)))
      continue;
    const std::array<inference::ProfileEnd, 2> ends =
        inference::profile_interval({problem, q, covariance, cost, options.search.interrupted}, which);
    const inference::Parameter& parameter = problem.space()[which];
    if (is_interrupted(options)) {
      outcome.interrupted = "profile";
      return;
    }
    ProfileInterval interval{{}, place, ends[0].found && ends[1].found};
    std::vector<std::array<double, 2>> tried{{q[which], 0.0}};
    for (size_t side = 0; side < 2; ++side) {
      interval.ci95[side] = parameter.value(ends[side].coordinate);
      interval.at_bound[side] = ends[side].at_bound;
      tried.insert(tried.end(), ends[side].tried.begin(), ends[side].tried.end());
    }
    std::sort(tried.begin(), tried.end());
    for (const auto& [coordinate, rise] : tried) {
      interval.value.push_back(parameter.value(coordinate));
      interval.cost_rise.push_back(rise);
    }
    outcome.profiles.push_back(interval);
  }
}

FittedPosterior summarised(const std::vector<Eigen::MatrixXd>& chains, Eigen::Index unknown,
                           const inference::Parameter& parameter) {
  std::vector<Eigen::VectorXd> draws;
  std::vector<double> sorted;
  for (const Eigen::MatrixXd& chain : chains) {
    Eigen::VectorXd& values = draws.emplace_back(chain.col(unknown));
    for (double& value : values)
      value = parameter.value(value);
    sorted.insert(sorted.end(), values.begin(), values.end());
  }
  std::sort(sorted.begin(), sorted.end());
  const Eigen::Map<const Eigen::ArrayXd> all(sorted.data(), static_cast<Eigen::Index>(sorted.size()));
  return {all.mean(),
          std::sqrt((all - all.mean()).square().sum() / static_cast<double>(all.size() - 1)),
          {signal::quantile_of_sorted(sorted, 0.025), signal::quantile_of_sorted(sorted, 0.975)},
          split_r_hat(draws),
          effective_sample_size(draws)};
}

void estimate_posterior(FitOutcome& outcome, JointProblem& problem, const Eigen::VectorXd& q,
                        const Eigen::MatrixXd& covariance, const FitOptions& options) {
  if (!options.posterior || !problem.residuals(q)) return;
  const auto begun = std::chrono::steady_clock::now();
  PosteriorOptions settings = *options.posterior;
  settings.interrupted = options.search.interrupted;
  const PosteriorSample sample = sample_posterior(problem, q, covariance, settings);
  if (sample.interrupted) {
    outcome.interrupted = "posterior";
    return;
  }
  PosteriorOutcome result{
      {options.posterior->chains * options.posterior->steps, sample.accepted, sample.solutions, 0}, {}};
  for (Eigen::Index i = 0; i < problem.values(); ++i)
    result.values.push_back(summarised(sample.chains, i, problem.space()[i]));
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  outcome.posterior = std::move(result);
}

}  // namespace

FitOutcome fit_motion(MotionModel& model, const std::vector<EstimatedParameter>& parameters,
                      const Measurement& measurement, const FitOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  FitOutcome outcome;
  JointProblem problem(model, parameters, measurement, options.locator, options.pressure_offset_sigma_kPa);
  problem.set_work(options.work);
  Eigen::VectorXd q = problem.start();
  problem.set_smoothness(smooth_blocks(model, options));
  if (options.robustness == Robustness::always) problem.set_robust(RobustLoss::for_deviation(1));
  search_until_same(problem, q, outcome, options);
  if (outcome.converged() && options.correction) {
    if (const std::optional<Eigen::VectorXd> correction = options.correction(problem, q)) {
      problem.set_correction(*correction);
      outcome.corrected = std::sqrt(correction->squaredNorm() / static_cast<double>(correction->size()));
      search_from(problem, q, outcome, options, false);
    }
  }
  if (outcome.converged()) require_half_usable(point_share(problem), options.file);
  if (!outcome.history.empty()) {
    const bool averaged = outcome.converged() && any_by_evidence(options) && problem.residuals(q);
    const Eigen::VectorXd estimate = averaged ? mean_over_steps(problem, q, options) : q;
    const Eigen::MatrixXd covariance =
        estimate_errors(outcome, problem, problem.residuals(estimate) ? estimate : q, options);
    if (outcome.converged()) {
      estimate_profiles(outcome, problem, q, covariance, options);
      estimate_posterior(outcome, problem, q, covariance, options);
    }
  }
  outcome.forward_solves = problem.forward_solves();
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return outcome;
}

}  // namespace diastole
