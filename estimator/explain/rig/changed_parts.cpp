#include "estimator/explain/rig/changed_parts.hpp"

#include <algorithm>

namespace diastole::explain {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool is_changed(const rig::SessionModel& model, std::string_view part) {
  return std::ranges::any_of(model.terms, [&](const rig::ModelTerm& term) {
    return part.substr(0, part.find('_')) == term.effect->text().changes;
  });
}

FreedStart free_changed_parts(const rig::SessionProblem& problem, rig::SessionModel start,
                              rig::LinearisedModel known) {
  const rig::TolerancePrior& learnt = problem.prior({});
  const Index count = learnt.mean.size();
  MatrixXd covariance = learnt.root * learnt.root.transpose();
  bool frees = false;
  for (Index i = 0; i < count; ++i) {
    const std::string& part = problem.nuisances()[static_cast<size_t>(i) + rig::basic_nuisances].name;
    if (covariance(i, i) >= 1.0 || !is_changed(start, part)) continue;
    covariance(i, i) += 1.0;
    frees = true;
  }
  if (!frees) return {std::move(start), std::move(known)};
  const MatrixXd before = problem.prior(known.at).root;
  const auto prior = std::make_shared<rig::TolerancePrior>(
      rig::TolerancePrior{learnt.mean, covariance.llt().matrixL(), learnt.described});
  const auto free = prior->root.triangularView<Eigen::Lower>();
  const auto convert = [&](rig::SessionModel& model) {
    model.nuisances.tail(count) = free.solve(before * model.nuisances.tail(count)).eval();
    model.prior = prior;
  };
  convert(start);
  convert(known.at);
  known.columns.rightCols(count) =
      (before.triangularView<Eigen::Lower>().solve<Eigen::OnTheRight>(known.columns.rightCols(count)) *
       prior->root)
          .eval();
  return {std::move(start), std::move(known)};
}

}  // namespace diastole::explain
