#include "estimator/explain/rig/held_out.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::explain {
namespace {

constexpr double linear_reach = 10.0;  // standard errors of a step that is taken for the fit
constexpr size_t dealt_parts = 3;      // into which a run's cycles are dealt when it cannot be left out whole
constexpr double determined_by = 0.999;  // of an unknown's information from one run: no other tells about it

Fold whole_run(const rig::Session& session, const rig::RigProblem& problem, size_t run) {
  Fold fold{session.runs[run].drive.place.name + ".run.h5", run, {}, {}};
  for (const rig::ResidualBlock& block : problem.blocks()) {
    if (block.run != run) continue;
    for (size_t k = 0; k < block.count; ++k)
      fold.rows.push_back(static_cast<Eigen::Index>(block.first + k));
  }
  return fold;
}

std::vector<Fold> cycles_dealt(const rig::Session& session, const rig::RigProblem& problem, size_t run) {
  std::vector<Fold> folds(dealt_parts, Fold{session.runs[run].drive.place.name + ".run.h5", run, {}, {}});
  const std::vector<rig::CycleRows> cycles = rig::cycles_of(session.runs[run]);
  for (const rig::ResidualBlock& block : problem.blocks()) {
    if (block.run != run || block.channel == "cavity_mL") continue;
    for (size_t c = 0; c < cycles.size(); ++c)
      for (size_t k = cycles[c].first; k < cycles[c].last; ++k)
        folds[c % dealt_parts].rows.push_back(static_cast<Eigen::Index>(block.first + k));
  }
  std::erase_if(folds, [](const Fold& fold) { return fold.rows.empty(); });
  return folds;
}

Eigen::MatrixXd normal_of(const Eigen::MatrixXd& jacobian, const std::vector<Eigen::Index>& rows) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(jacobian.cols(), jacobian.cols());
  for (const Eigen::Index row : rows)
    normal.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.row(row).transpose());
  return normal.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd full_normal(const rig::RigFit& fit) { return fit.jacobian.transpose() * fit.jacobian; }

/// Whether some unknown that the data determine is no longer determined without the rows.
bool undetermined(const Eigen::MatrixXd& normal, const Eigen::MatrixXd& left_out) {
  const auto scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse().eval();
  const Eigen::MatrixXd all = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::MatrixXd part = scale.asDiagonal() * left_out * scale.asDiagonal();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> share(
      part, all + 1e-9 * Eigen::MatrixXd::Identity(all.rows(), all.cols()));
  return share.eigenvalues().maxCoeff() > determined_by;
}

}  // namespace

std::vector<Fold> folds_for(const rig::Session& session, const rig::RigProblem& problem,
                            const rig::RigFit& fit) {
  const Eigen::MatrixXd normal = full_normal(fit);
  std::vector<Fold> folds;
  for (size_t run = 0; run < session.runs.size(); ++run) {
    Fold fold = whole_run(session, problem, run);
    if (session.runs.size() > 1 && !undetermined(normal, normal_of(fit.jacobian, fold.rows))) {
      fold.others.assign(session.runs.size(), true);
      fold.others[run] = false;
      folds.push_back(std::move(fold));
    } else {
      for (Fold& dealt : cycles_dealt(session, problem, run))
        folds.push_back(std::move(dealt));
    }
  }
  return folds;
}

double predicted_square(const rig::RigProblem& problem, const std::vector<Fold>& folds,
                        const rig::RigFit& fit, const Eigen::VectorXd& weights) {
  const Eigen::MatrixXd normal = full_normal(fit);
  double square = 0.0;
  for (const Fold& fold : folds) {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(normal.rows());
    for (const Eigen::Index row : fold.rows)
      gradient += fit.residuals[row] * fit.jacobian.row(row).transpose();
    const Eigen::MatrixXd rest = normal - normal_of(fit.jacobian, fold.rows);
    const Eigen::VectorXd step = rest.completeOrthogonalDecomposition().solve(gradient);
    Eigen::VectorXd predicted = fit.residuals;
    if (step.dot(normal * step) < linear_reach * linear_reach || fold.others.empty()) {
      for (const Eigen::Index row : fold.rows)
        predicted[row] += fit.jacobian.row(row).dot(step);
    } else {
      const rig::RigFit others =
          problem.fit_from(fit, {.fidelity = rig::Fidelity::fine, .runs = fold.others});
      predicted = problem.residuals(others);
    }
    for (const Eigen::Index row : fold.rows)
      square += weights[row] * predicted[row] * predicted[row];
  }
  return square;
}

namespace {

/// Half the mean square of the differences between successive cycles' residuals.
double unrepeatable(const rig::Session& session, const rig::RigProblem& problem, const rig::RigFit& fit,
                    const Eigen::VectorXd& weights) {
  double square = 0.0;
  double weight = 0.0;
  for (const rig::ResidualBlock& block : problem.blocks()) {
    if (block.channel == "cavity_mL") continue;
    const std::vector<rig::CycleRows> cycles = rig::cycles_of(session.runs[block.run]);
    for (size_t c = 1; c < cycles.size(); ++c) {
      const size_t count = cycles[c].last - cycles[c].first;
      if (cycles[c - 1].last - cycles[c - 1].first != count) continue;
      for (size_t k = 0; k < count; ++k) {
        const auto row = static_cast<Eigen::Index>(block.first + cycles[c].first + k);
        const auto before = static_cast<Eigen::Index>(block.first + cycles[c - 1].first + k);
        const double change = fit.residuals[row] - fit.residuals[before];
        square += 0.5 * weights[row] * change * change;
        weight += weights[row];
      }
    }
  }
  return weight > 0.0 ? square / weight : 1.0;
}

}  // namespace

Gap held_out_gap(const rig::Session& session, const rig::RigProblem& problem, const rig::RigFit& fit,
                 const Eigen::VectorXd& weights) {
  Gap gap;
  const std::vector<Fold> folds = folds_for(session, problem, fit);
  double count = 0.0;
  for (const Fold& fold : folds) {
    for (const Eigen::Index row : fold.rows)
      count += weights[row];
    if (gap.held_out.empty() || gap.held_out.back() != fold.name) gap.held_out.push_back(fold.name);
  }
  gap.before = predicted_square(problem, folds, problem.base(), weights) / count;
  gap.after = predicted_square(problem, folds, fit, weights) / count;
  gap.floor = std::min(unrepeatable(session, problem, fit, weights), gap.after);
  gap.closed = gap.before > gap.floor ? 1.0 - (gap.after - gap.floor) / (gap.before - gap.floor) : 0.0;
  return gap;
}

}  // namespace diastole::explain
