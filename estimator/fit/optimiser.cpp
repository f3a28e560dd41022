#include "estimator/fit/optimiser.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace diastole {
namespace {

constexpr double nothing_gained = 1e-3;   // of the cost: a twentieth of a standard error
constexpr double tolerances_gained = 10;  // or as many of the tolerance of the cost

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class JointCost : public ceres::CostFunction {
 public:
  JointCost(JointProblem& problem, std::optional<Eigen::Index> held) : problem_(problem), held_(held) {
    set_num_residuals(static_cast<int>(problem.rows()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.unknowns()));
  }

  bool Evaluate(double const* const* unknowns, double* residuals, double** jacobians) const override {
    const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(unknowns[0], problem_.unknowns());
    const Eigen::VectorXd* found = problem_.residuals(q);
    if (found == nullptr) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, found->size()) = *found;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<RowMajor> jacobian(jacobians[0], problem_.rows(), problem_.unknowns());
      jacobian = problem_.jacobian(q);
      const Eigen::VectorXd gradient = jacobian.transpose() * *found;
      for (Eigen::Index i = 0; i < q.size(); ++i) {
        if (is_held(q, gradient, i)) jacobian.col(i).setZero();
      }
    }
    return true;
  }

 private:
  /// Whether an unknown is to keep its value, or rests on its bound and the cost falls only beyond it.
  [[nodiscard]] bool is_held(const Eigen::VectorXd& q, const Eigen::VectorXd& gradient,
                             Eigen::Index i) const {
    if (held_ == i) return true;
    const BoundSide side = problem_.bound_under(q, i);
    return (side == BoundSide::lower && gradient[i] > 0) || (side == BoundSide::upper && gradient[i] < 0);
  }

  JointProblem& problem_;
  std::optional<Eigen::Index> held_;
};

class Recorder : public ceres::IterationCallback {
 public:
  Recorder(const Eigen::VectorXd& q, const OptimiserOptions& options) : q_(q), options_(options) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
    iterations = step.iteration;
    if (step.iteration > 0 && !step.step_is_successful) ++refused;
    if (options_.on_step) options_.on_step({step.iteration, step.cost, step.step_is_successful, q_});
    interrupted = options_.interrupted && options_.interrupted();
    return interrupted ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

  int iterations = 0;
  int refused = 0;
  bool interrupted = false;

 private:
  const Eigen::VectorXd& q_;
  const OptimiserOptions& options_;
};

std::string reason_of(const ceres::Solver::Summary& summary, const JointProblem& problem,
                      const OptimiserOptions& options) {
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
      if (summary.message.starts_with("Function")) {
        return fmt::format("Converged: the last step changed the cost by less than {:g} of it.",
                           options.cost_tolerance);
      }
      if (summary.message.starts_with("Parameter")) {
        return fmt::format("Converged: the last step changed the unknowns by less than {:g} of them.",
                           options.step_tolerance);
      }
      return "Converged: the cost's gradient vanishes.";
    case ceres::NO_CONVERGENCE:
      return fmt::format("Stopped at the limit of {} iterations; the cost was still falling.",
                         options.iteration_limit);
    default:
      return problem.failure().empty() ? "Failed: no step lowers the cost."
                                       : fmt::format("Failed: {}.", problem.failure());
  }
}

/// By how much the cost would fall in a step of its quadratic model, bounds held.
double promised_gain(const JointCost& cost, const JointProblem& problem, const Eigen::VectorXd& q) {
  Eigen::VectorXd residuals(problem.rows());
  RowMajor jacobian(problem.rows(), problem.unknowns());
  const double* unknowns[] = {q.data()};
  double* jacobians[] = {jacobian.data()};
  if (!cost.Evaluate(unknowns, residuals.data(), jacobians)) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXd length = jacobian.colwise().norm();
  for (Eigen::Index i = 0; i < q.size(); ++i)
    jacobian.col(i) /= length[i] > 0 ? length[i] : 1.0;
  const Eigen::VectorXd gradient = jacobian.transpose() * residuals;
  const Eigen::MatrixXd curvature = jacobian.transpose() * jacobian;
  return 0.5 * gradient.dot(curvature.completeOrthogonalDecomposition().solve(gradient));
}

}  // namespace

OptimiserResult minimise(JointProblem& problem, const Eigen::VectorXd& start,
                         const OptimiserOptions& options) {
  Eigen::VectorXd q = start;
  JointCost cost(problem, options.held);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem least_squares(ownership);
  least_squares.AddResidualBlock(&cost, nullptr, q.data());
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    if (std::isfinite(problem.lower(i)))
      least_squares.SetParameterLowerBound(q.data(), static_cast<int>(i), problem.lower(i));
    if (std::isfinite(problem.upper(i)))
      least_squares.SetParameterUpperBound(q.data(), static_cast<int>(i), problem.upper(i));
  }
  Recorder recorder(q, options);
  ceres::Solver::Options settings;
  settings.linear_solver_type = ceres::DENSE_QR;
  settings.max_num_iterations = std::max(0, options.iteration_limit - options.iterations_before);
  settings.function_tolerance = options.cost_tolerance;
  settings.parameter_tolerance = options.step_tolerance;
  settings.gradient_tolerance = 1e-12;
  // The projected line search would solve the equilibrium again and again at one step; projection is enough.
  settings.max_num_line_search_step_size_iterations = 0;
  settings.update_state_every_iteration = true;
  settings.callbacks = {&recorder};
  settings.logging_type = ceres::SILENT;
  FLAGS_minloglevel = google::GLOG_FATAL;  // a failed solution is told by the summary
  ceres::Solver::Summary summary;
  ceres::Solve(settings, &least_squares, &summary);
  OptimiserResult result{
      .q = q,
      .converged = summary.termination_type == ceres::CONVERGENCE,
      .reason = recorder.interrupted
                    ? fmt::format("Stopped on request after {} iterations; the cost was still falling.",
                                  options.iterations_before + recorder.iterations)
                    : reason_of(summary, problem, options),
      .iterations = recorder.iterations};
  const double little =
      std::max(nothing_gained, tolerances_gained * options.cost_tolerance * summary.final_cost);
  if (result.converged && recorder.refused > 0 && promised_gain(cost, problem, q) > little) {
    result.converged = false;
    result.stalled = true;
    result.reason = "Failed: the cost has a slope, but no step lowers it.";
  }
  return result;
}

}  // namespace diastole
