#include "estimator/explain/rig/part_strain.hpp"

#include <cmath>

#include "estimator/inference/tail_probability.hpp"

namespace diastole::explain {

double largest_tolerance(const rig::SessionProblem& problem, const rig::SessionModel& model,
                         const Eigen::VectorXd& u) {
  const Eigen::VectorXd& described = problem.prior(model).described;
  if (described.size() == 0) return 0.0;
  return u.tail(described.size()).cwiseProduct(described).cwiseAbs().maxCoeff();
}

double largest_tolerance(const rig::SessionProblem& problem, const EffectSet& set) {
  return largest_tolerance(problem, set.model, set.model.nuisances);
}

double fineness(const rig::SessionProblem& problem, const rig::SessionModel& model) {
  const Eigen::VectorXd& described = problem.prior(model).described;
  return described.size() > 0 ? described.minCoeff() : 1.0;
}

double strain_by_chance(const rig::SessionProblem& problem, const rig::SessionModel& model,
                        const Eigen::VectorXd& u) {
  const auto tolerances = static_cast<double>(problem.nuisances().size() - rig::basic_nuisances);
  return -std::expm1(tolerances *
                     std::log1p(-2.0 * inference::normal_tail(largest_tolerance(problem, model, u))));
}

bool is_strained(const rig::SessionProblem& problem, const EffectSet& set) {
  return strain_by_chance(problem, set.model, set.model.nuisances) < surprising_by_chance;
}

}  // namespace diastole::explain
