#include "estimator/inference/least_squares.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "estimator/inference/linear_model.hpp"

namespace diastole::inference {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double nothing_gained = 2e-3;   // of chi-square: a twentieth of a standard error
constexpr double tolerances_gained = 10;  // or as many of the tolerance of the cost
constexpr double hardly_damped = 10;   // radius of the trust region from which a step is nearly the best one
constexpr double poor_gain = 0.25;     // of the expected one
constexpr size_t creeping_steps = 10;  // the trust region may grow by 3^10 in so many
constexpr double trusted_over_sigmas = 2;  // a kept Jacobian, where a search would end

/// One round of Ceres' minimiser goes from a linear model to the end of the search, or to where the Jacobian must be
/// computed afresh or the box that limits the steps moves on.
class Search {
 public:
  Search(LeastSquaresProblem& problem, const SearchOptions& options) : problem_(problem), options_(options) {}

  SearchResult from(const VectorXd& start);

  /// What Ceres asks for; the Jacobian, where wanted, at a point that it has accepted. False without a solution.
  bool evaluate(const VectorXd& q, double* residuals, double* jacobian);
  /// After each step; whether the round goes on.
  bool go_on(const ceres::IterationSummary& step);

 private:
  enum class RoundEnd {
    ceres,
    small_gain,
    refusals,
    creeping,
    interrupted,
    hopeless,
    fresh_jacobian,
    next_box
  };
  struct Point {
    VectorXd q, residuals;
  };

  bool solve(const VectorXd& q);
  void accept(const VectorXd& q);
  void linearise();
  [[nodiscard]] std::vector<bool> held() const;
  [[nodiscard]] double small_gain() const;
  [[nodiscard]] bool is_creeping() const;
  [[nodiscard]] RoundEnd end_after(const ceres::IterationSummary& step);
  ceres::Solver::Summary minimise_round();
  [[nodiscard]] bool needs_another_round(const ceres::Solver::Summary& summary);
  void conclude(const ceres::Solver::Summary& summary);
  void conclude_converged(std::string reason);

  LeastSquaresProblem& problem_;
  const SearchOptions& options_;
  LinearModel model_;  // at the best point so far
  Point trial_;
  SearchResult result_;
  RoundEnd end_ = RoundEnd::ceres;
  std::deque<double> chi_squares_;  // after the last accepted steps
  int before_round_ = 0, refused_ = 0, refused_in_a_row_ = 0;
  double radius_ = 0, gain_ = 0, expected_gain_ = 0;
  bool step_was_on_fresh_ = true;
};

class Cost : public ceres::CostFunction {
 public:
  Cost(Search& search, Index rows, Index unknowns) : search_(search) {
    set_num_residuals(static_cast<int>(rows));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(unknowns));
  }
  bool Evaluate(double const* const* unknowns, double* residuals, double** jacobians) const override {
    const VectorXd q = Eigen::Map<const VectorXd>(unknowns[0], parameter_block_sizes()[0]);
    return search_.evaluate(q, residuals, jacobians == nullptr ? nullptr : jacobians[0]);
  }

 private:
  Search& search_;
};

class AfterStep : public ceres::IterationCallback {
 public:
  explicit AfterStep(Search& search) : search_(search) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
    return search_.go_on(step) ? ceres::SOLVER_CONTINUE : ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

 private:
  Search& search_;
};

bool Search::solve(const VectorXd& q) {
  ++result_.evaluations;
  std::optional<VectorXd> residuals = problem_.residuals(q);
  if (!residuals) return false;
  trial_ = {q, std::move(*residuals)};
  return true;
}

void Search::linearise() {
  ++result_.linearisations;
  model_.jacobian = problem_.jacobian(model_.q);
  model_.kept_over_sigmas = 0;
}

void Search::accept(const VectorXd& q) {
  gain_ = model_.chi_square() - trial_.residuals.squaredNorm();
  expected_gain_ = model_.expected_gain(q - model_.q);
  step_was_on_fresh_ = model_.kept_over_sigmas == 0;
  if (problem_.linearisation() == Linearisation::kept) {
    model_.move_to(q, trial_.residuals);
  } else {
    model_.q = q;
    model_.residuals = trial_.residuals;
    linearise();
  }
}

bool Search::evaluate(const VectorXd& q, double* residuals, double* jacobian) {
  const bool known = q == model_.q;
  if (!known && q != trial_.q && !solve(q)) return false;
  if (jacobian != nullptr) {
    if (!known) accept(q);
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<RowMajor> columns(jacobian, model_.jacobian.rows(), model_.jacobian.cols());
    columns = model_.jacobian;
    const std::vector<bool> still = held();
    for (Index i = 0; i < q.size(); ++i) {
      if (still[static_cast<size_t>(i)]) columns.col(i).setZero();
    }
  }
  const VectorXd& here = q == model_.q ? model_.residuals : trial_.residuals;
  Eigen::Map<VectorXd>(residuals, here.size()) = here;
  return true;
}

std::vector<bool> Search::held() const {
  std::vector<bool> result = pressed_on_bounds(model_, problem_.space());
  for (size_t i = 0; i < options_.held.size(); ++i)
    result[i] = result[i] || options_.held[i];
  return result;
}

double Search::small_gain() const {
  if (options_.small_gain) return options_.small_gain(model_.chi_square());
  return std::max(nothing_gained, tolerances_gained * options_.cost_tolerance * model_.chi_square());
}

/// Whether the last accepted steps together gained next to nothing.
bool Search::is_creeping() const {
  return options_.small_gain && chi_squares_.size() > creeping_steps &&
         chi_squares_.front() - chi_squares_.back() < small_gain();
}

bool Search::go_on(const ceres::IterationSummary& step) {
  end_ = end_after(step);
  return end_ == RoundEnd::ceres;
}

Search::RoundEnd Search::end_after(const ceres::IterationSummary& step) {
  const bool first = step.iteration == 0;
  const bool refused = !first && !step.step_is_successful;
  result_.iterations = before_round_ + step.iteration;
  if (!first) refused_in_a_row_ = refused ? refused_in_a_row_ + 1 : 0;
  if (refused) ++refused_;
  const SearchStep report{result_.iterations, step.cost, step.step_is_successful, model_.q};
  if (options_.on_step && (!first || before_round_ == 0)) options_.on_step(report);
  if (options_.interrupted && options_.interrupted()) return RoundEnd::interrupted;
  if (options_.hopeless && options_.hopeless(report)) return RoundEnd::hopeless;
  // The radius stays: it is the Jacobian that was refused.
  if (refused && model_.kept_over_sigmas > 0) return RoundEnd::fresh_jacobian;
  const double radius_before = std::exchange(radius_, step.trust_region_radius);
  if (refused) return refused_in_a_row_ >= options_.refusal_limit ? RoundEnd::refusals : RoundEnd::ceres;
  if (!first) {
    chi_squares_.push_back(model_.chi_square());
    if (chi_squares_.size() > creeping_steps + 1) chi_squares_.pop_front();
    if (is_creeping()) return RoundEnd::creeping;
  }
  const bool enough = options_.small_gain && gain_ < small_gain();
  if (!first && enough && step_was_on_fresh_ && radius_before >= hardly_damped) return RoundEnd::small_gain;
  if (!first && model_.kept_over_sigmas > 0 && gain_ < poor_gain * expected_gain_)
    return RoundEnd::fresh_jacobian;
  if (options_.small_gain && model_.greatest_gain(held()) < small_gain())
    return model_.kept_over_sigmas < trusted_over_sigmas ? RoundEnd::small_gain : RoundEnd::fresh_jacobian;
  return !first && options_.longest_step.size() > 0 ? RoundEnd::next_box : RoundEnd::ceres;
}

ceres::Solver::Summary Search::minimise_round() {
  end_ = RoundEnd::ceres;
  before_round_ = result_.iterations;
  VectorXd q = model_.q;
  const ParameterSpace& space = problem_.space();
  Cost cost(*this, model_.residuals.size(), q.size());
  AfterStep after_step(*this);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem least_squares(ownership);
  least_squares.AddResidualBlock(&cost, nullptr, q.data());
  VectorXd lower = space.lower(), upper = space.upper();
  if (options_.longest_step.size() > 0) {
    lower = lower.cwiseMax(q - options_.longest_step);
    upper = upper.cwiseMin(q + options_.longest_step);
  }
  for (Index i = 0; i < q.size(); ++i) {
    if (std::isfinite(lower[i]))
      least_squares.SetParameterLowerBound(q.data(), static_cast<int>(i), lower[i]);
    if (std::isfinite(upper[i]))
      least_squares.SetParameterUpperBound(q.data(), static_cast<int>(i), upper[i]);
  }
  ceres::Solver::Options settings;
  settings.linear_solver_type = ceres::DENSE_QR;
  settings.max_num_iterations =
      std::max(0, options_.iteration_limit - options_.iterations_before - before_round_);
  settings.initial_trust_region_radius = radius_;
  settings.function_tolerance = options_.cost_tolerance;
  settings.parameter_tolerance = options_.step_tolerance;
  settings.gradient_tolerance = 1e-12;
  // The projected line search would solve the model again and again at one step; projection is enough.
  settings.max_num_line_search_step_size_iterations = 0;
  settings.callbacks = {&after_step};
  settings.logging_type = ceres::SILENT;
  FLAGS_minloglevel = google::GLOG_FATAL;  // the summary reports a failed solution
  ceres::Solver::Summary summary;
  ceres::Solve(settings, &least_squares, &summary);
  return summary;
}

bool Search::needs_another_round(const ceres::Solver::Summary& summary) {
  const bool doubtful = end_ == RoundEnd::ceres && summary.termination_type == ceres::CONVERGENCE &&
                        model_.kept_over_sigmas >= trusted_over_sigmas;
  if (doubtful || end_ == RoundEnd::fresh_jacobian) {
    linearise();
    return true;
  }
  return end_ == RoundEnd::next_box;
}

void Search::conclude_converged(std::string reason) {
  const bool beyond = std::ranges::any_of(result_.pressed, std::identity());
  result_.termination = beyond ? Termination::on_bound : Termination::converged;
  result_.reason = std::move(reason);
}

void Search::conclude(const ceres::Solver::Summary& summary) {
  result_.pressed = pressed_on_bounds(model_, problem_.space());
  for (size_t i = 0; i < options_.held.size(); ++i)
    result_.pressed[i] = result_.pressed[i] && !options_.held[i];
  result_.crept = end_ == RoundEnd::creeping;
  const bool settled = end_ == RoundEnd::ceres && summary.termination_type == ceres::CONVERGENCE;
  if (end_ == RoundEnd::interrupted || end_ == RoundEnd::hopeless) {
    result_.termination = Termination::interrupted;
    result_.reason = fmt::format("Stopped on request after {} iterations; the cost was still falling.",
                                 options_.iterations_before + result_.iterations);
  } else if (end_ == RoundEnd::small_gain) {
    conclude_converged(
        fmt::format("Converged: no step lowers chi-square by more than {:.2g}.", small_gain()));
  } else if ((end_ == RoundEnd::refusals || result_.crept || (settled && refused_ > 0)) &&
             model_.greatest_gain(held()) > small_gain()) {
    result_.termination = Termination::stalled;
    result_.reason =
        result_.crept
            ? fmt::format("Failed: the last {} steps together lowered chi-square by less than {:.2g}.",
                          creeping_steps, small_gain())
            : sentence(Termination::stalled);
  } else if (settled && summary.message.starts_with("Function")) {
    conclude_converged(fmt::format("Converged: the last step changed the cost by less than {:g} of it.",
                                   options_.cost_tolerance));
  } else if (settled && summary.message.starts_with("Parameter")) {
    conclude_converged(fmt::format("Converged: the last step changed the unknowns by less than {:g} of them.",
                                   options_.step_tolerance));
  } else if (settled || end_ == RoundEnd::refusals || result_.crept) {
    conclude_converged("Converged: the cost's gradient vanishes.");
  } else if (summary.termination_type == ceres::NO_CONVERGENCE) {
    result_.termination = Termination::iteration_limit;
    result_.reason = fmt::format("Stopped at the limit of {} iterations; the cost was still falling.",
                                 options_.iteration_limit);
  } else {
    result_.termination = Termination::stalled;
    result_.reason = "Failed: no step lowers the cost.";
  }
}

SearchResult Search::from(const VectorXd& start) {
  result_.q = problem_.space().clamped(start);
  if (!solve(result_.q)) {
    result_.reason = fmt::format("Failed: {}.", problem_.failure());
    return std::move(result_);
  }
  model_.q = result_.q;
  model_.residuals = trial_.residuals;
  linearise();
  chi_squares_ = {model_.chi_square()};
  radius_ = options_.first_radius;
  ceres::Solver::Summary summary;
  do
    summary = minimise_round();
  while (needs_another_round(summary));
  conclude(summary);
  result_.q = model_.q;
  result_.residuals = std::move(model_.residuals);
  result_.jacobian = std::move(model_.jacobian);
  return std::move(result_);
}

}  // namespace

Eigen::MatrixXd central_differences(LeastSquaresProblem& problem, const Eigen::VectorXd& q) {
  constexpr double step = 1e-6;
  Eigen::MatrixXd result;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const Eigen::VectorXd by = step * Eigen::VectorXd::Unit(q.size(), i);
    const Eigen::VectorXd column =
        (problem.residuals(q + by).value() - problem.residuals(q - by).value()) / (2 * step);
    result.conservativeResize(column.size(), q.size());
    result.col(i) = column;
  }
  return result;
}

SearchResult minimise(LeastSquaresProblem& problem, const VectorXd& start, const SearchOptions& options) {
  return Search(problem, options).from(start);
}

}  // namespace diastole::inference
