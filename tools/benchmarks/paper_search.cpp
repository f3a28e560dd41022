#include "tools/benchmarks/paper_search.hpp"

#include <fmt/format.h>
#include <nlopt.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

namespace diastole {
namespace {

constexpr double difference = 1e-4;  // of a parameter's value: well above the equilibria's own error

struct Search {
  JointProblem& problem;
  const inference::SearchOptions& options;
  nlopt_opt optimiser;
  int iterations = 0;
  double worst_cost = 0;  ///< what a point without equilibrium is said to cost
  double best_cost = 0;
  Eigen::VectorXd best_q{};

  [[nodiscard]] Eigen::VectorXd coordinates(const double* values) const {
    Eigen::VectorXd q(problem.values());
    for (Eigen::Index i = 0; i < q.size(); ++i)
      q[i] = problem.space()[i].coordinate(values[i]);
    return q;
  }

  [[nodiscard]] double cost(const Eigen::VectorXd& q) {
    if (!problem.residuals(q)) return worst_cost;
    double squares_mm2 = 0;
    for (const JointProblem::LoadedFrame& frame : problem.frames())
      squares_mm2 += frame.residuals.residuals().cwiseProduct(frame.residuals.sigmas_mm()).squaredNorm();
    return squares_mm2 / 2;
  }
};

double evaluate(unsigned count, const double* values, double* gradient, void* data) {
  Search& search = *static_cast<Search*>(data);
  const Eigen::VectorXd q = search.coordinates(values);
  const double here = search.cost(q);
  if (search.worst_cost == 0) search.worst_cost = 1e3 * (1 + here);
  const bool better = search.best_q.size() == 0 || here < search.best_cost;
  if (better) {
    search.best_q = q;
    search.best_cost = here;
  }
  if (gradient == nullptr) return here;
  if (search.options.on_step) search.options.on_step({search.iterations, here, better, search.best_q});
  if (search.options.interrupted && search.options.interrupted()) {
    nlopt_force_stop(search.optimiser);
    std::fill(gradient, gradient + count, 0.0);
    return here;
  }
  ++search.iterations;
  std::vector<double> moved(values, values + count);
  for (unsigned i = 0; i < count; ++i) {
    const double step = difference * std::max(std::abs(values[i]), 1e-3);
    moved[i] = values[i] + step;
    gradient[i] = (search.cost(search.coordinates(moved.data())) - here) / step;
    moved[i] = values[i];
  }
  return here;
}

void conclude(inference::SearchResult& found, nlopt_result result, const Search& search) {
  using inference::Termination;
  const auto end = [&](Termination termination, std::string reason) {
    found.termination = termination;
    found.reason = std::move(reason);
  };
  switch (result) {
    case NLOPT_XTOL_REACHED:
      return end(
          Termination::converged,
          fmt::format("Converged: the last step changed the parameters by less than {:g} of their norm.",
                      paper_tolerance));
    case NLOPT_SUCCESS:
    case NLOPT_FTOL_REACHED:
      return end(Termination::converged, "Converged: the cost's gradient vanishes.");
    case NLOPT_ROUNDOFF_LIMITED:
      return end(Termination::stalled,
                 "Failed: the differences' own error hides the direction in which the cost falls.");
    case NLOPT_FORCED_STOP:
      return end(Termination::interrupted,
                 fmt::format("Stopped on request after {} iterations; the cost was still falling.",
                             search.iterations));
    case NLOPT_MAXEVAL_REACHED:
      return end(Termination::iteration_limit,
                 fmt::format("Stopped at the limit of {} evaluations of the cost; it was still falling.",
                             search.options.iteration_limit));
    default:
      return end(Termination::stalled, "Failed: sequential quadratic programming found no step.");
  }
}

inference::SearchResult search_once(JointProblem& problem, const Eigen::VectorXd& start,
                                    const inference::SearchOptions& options) {
  const auto count = static_cast<unsigned>(problem.values());
  std::vector<double> values, lower, upper;
  for (Eigen::Index i = 0; i < problem.values(); ++i) {
    const inference::Parameter& parameter = problem.space()[i];
    values.push_back(parameter.value(start[i]));
    lower.push_back(parameter.lower);
    upper.push_back(parameter.upper);
  }
  const std::unique_ptr<std::remove_pointer_t<nlopt_opt>, decltype(&nlopt_destroy)> optimiser(
      nlopt_create(NLOPT_LD_SLSQP, count), nlopt_destroy);
  Search search{problem, options, optimiser.get()};
  nlopt_set_lower_bounds(optimiser.get(), lower.data());
  nlopt_set_upper_bounds(optimiser.get(), upper.data());
  nlopt_set_min_objective(optimiser.get(), evaluate, &search);
  nlopt_set_xtol_rel(optimiser.get(), paper_tolerance);
  nlopt_set_maxeval(optimiser.get(), options.iteration_limit);
  double cost = 0;
  const nlopt_result result = nlopt_optimize(optimiser.get(), values.data(), &cost);
  inference::SearchResult found;
  found.q = start;
  found.reason = fmt::format("Failed: {}.", problem.failure());
  found.iterations = search.iterations;
  if (search.best_q.size() == 0) return found;
  found.q = search.best_q;
  conclude(found, result, search);
  return found;
}

}  // namespace

PaperFit fit_as_the_paper(MotionModel& model, const std::vector<EstimatedParameter>& parameters,
                          Measurement measurement, LocatorOptions locator,
                          const inference::SearchOptions& search) {
  constexpr int most_searches = 8;     // while a better motion finds more usable points
  measurement.planes_as_seen = false;  // the paper knows where the tags were
  for (Frame& frame : measurement.frames)
    frame.sigma_kPa = 0;
  JointProblem problem(model, parameters, measurement, locator);
  Eigen::VectorXd q = problem.start();
  PaperFit fit;
  for (int round = 0; round < most_searches; ++round) {
    const std::optional<size_t> gained = problem.find_points(q);
    if (gained && *gained == 0 && round > 0) break;
    if (!gained) {
      fit.termination = inference::Termination::no_solution;
      fit.reason = fmt::format("Failed: {}.", problem.failure());
      break;
    }
    const inference::SearchResult found = search_once(problem, q, search);
    q = found.q;
    fit.termination = found.termination;
    fit.reason = found.reason;
    fit.iterations += found.iterations;
    if (!is_settled(found.termination)) break;
  }
  fit.values = problem.space().values(q);
  fit.forward_solves = problem.forward_solves();
  return fit;
}

}  // namespace diastole
