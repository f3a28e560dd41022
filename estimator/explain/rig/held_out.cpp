#include "estimator/explain/rig/held_out.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include "estimator/explain/rig/law_fit.hpp"
#include "estimator/explain/rig/part_strain.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Squares of what values fitted to all but some rows leave there.
struct HeldOut {
  double square = 0.0;
  double count = 0.0;
};
void predict(const EffectSet& set, const std::vector<bool>& held, const VectorXd& variance, HeldOut& sum) {
  const VectorXd target = set.target();
  VectorXd weight = variance.cwiseInverse();
  for (Index i = 0; i < weight.size(); ++i)
    if (held[static_cast<size_t>(i)]) weight[i] = 0.0;
  MatrixXd normal = set.columns.transpose() * weight.asDiagonal() * set.columns;
  normal.diagonal().array() += 1.0;
  const Eigen::LLT<MatrixXd> factor(normal);
  const VectorXd w = factor.solve(set.columns.transpose() * weight.cwiseProduct(target));
  for (Index i = 0; i < weight.size(); ++i) {
    if (!held[static_cast<size_t>(i)]) continue;
    const double miss = target[i] - set.columns.row(i).dot(w);
    // What the others leave open of the prediction is no misfit.
    const double open = set.columns.row(i).dot(factor.solve(set.columns.row(i).transpose()));
    sum.square += miss * miss / (variance[i] + open);
    sum.count += 1.0;
  }
}

/// What the commanded motion is at a time.
struct MotionState {
  double volume = 0.0, flow = 0.0;  ///< over the largest of the session
  double phase = 0.0;               ///< part of the cycle
};

constexpr int highest_power = 3;
constexpr int highest_harmonic = 2;

std::vector<double> smooth_values(const MotionState& at) {
  std::vector<double> values;
  for (int power = 1; power <= highest_power; ++power)
    for (int of_flow = 0; of_flow <= power; ++of_flow)
      values.push_back(std::pow(at.volume, power - of_flow) * std::pow(at.flow, of_flow));
  for (int harmonic = 1; harmonic <= highest_harmonic; ++harmonic) {
    const double angle = 2.0 * std::numbers::pi * harmonic * at.phase;
    values.push_back(std::cos(angle));
    values.push_back(std::sin(angle));
  }
  return values;
}

/// At each sample of a run.
std::vector<MotionState> motion_of(const rig::SessionRun& run) {
  std::vector<MotionState> states;
  for (const double time_s : run.sample_s) {
    const rig::Motion::State at = run.drive.motion.at(time_s);
    states.push_back({at.volume_mL, at.flow_mL_per_s, rig::cycle_at(run.drive.place, time_s).phase});
  }
  return states;
}

std::vector<std::vector<MotionState>> motions_of(const rig::Session& session) {
  std::vector<std::vector<MotionState>> runs;
  double volume = 0.0;
  double flow = 0.0;
  for (const rig::SessionRun& run : session.runs)
    for (const MotionState& at : runs.emplace_back(motion_of(run))) {
      volume = std::max(volume, std::abs(at.volume));
      flow = std::max(flow, std::abs(at.flow));
    }
  for (auto& states : runs)
    for (MotionState& at : states) {
      if (volume > 0.0) at.volume /= volume;
      if (flow > 0.0) at.flow /= flow;
    }
  return runs;
}

LinearFeatures features_of(const EffectSet& set) { return {set.target(), set.columns}; }

}  // namespace

std::vector<Fold> folds_of(const rig::SessionProblem& problem) {
  const auto& runs = problem.session().runs;
  const bool by_run = runs.size() > 1;
  std::map<std::pair<size_t, size_t>, Fold> folds;
  for (const rig::FeatureBlock& block : problem.features().blocks()) {
    if (block.at_rest && !by_run) continue;
    Fold& fold = folds[{block.run, by_run ? 0 : block.segment}];
    fold.name = runs[block.run].drive.place.name + ".run.h5";
    if (!by_run) fold.name += fmt::format(", segment {}", block.segment);
    fold.held.resize(static_cast<size_t>(problem.features().count()), false);
    std::fill_n(fold.held.begin() + static_cast<std::ptrdiff_t>(block.first), block.features.size(), true);
  }
  std::vector<Fold> list;
  for (auto& [place, fold] : folds)
    list.push_back(std::move(fold));
  return list;
}

Gap held_out_gap(const rig::SessionProblem& problem, const EffectSet& before, const EffectSet& after) {
  Gap gap;
  HeldOut old, now;
  for (const Fold& fold : folds_of(problem)) {
    predict(before, fold.held, after.evidence.variance, old);
    predict(after, fold.held, after.evidence.variance, now);
    gap.held_out.push_back(fold.name);
  }
  if (old.count == 0.0) return gap;
  gap.before = old.square / old.count;
  gap.after = now.square / now.count;
  gap.floor = std::min(1.0, after.evidence.left.cwiseAbs2().cwiseQuotient(after.evidence.variance).mean());
  gap.closed = gap.before > gap.floor
                   ? std::clamp(1.0 - (gap.after - gap.floor) / (gap.before - gap.floor), 0.0, 1.0)
                   : 0.0;
  return gap;
}

std::vector<Index> Fold::others() const {
  std::vector<Index> rows;
  for (size_t i = 0; i < held.size(); ++i)
    if (!held[i]) rows.push_back(static_cast<Index>(i));
  return rows;
}

double held_out_density(const LinearFeatures& features, const rig::ModelError& error,
                        const std::vector<Index>& others, const rig::Shares& shares) {
  return fit_linear(features.target, features.columns, error, shares).log_evidence -
         fit_linear(features.target(others), features.columns(others, Eigen::all),
                    error_of_rows(error, others), shares)
             .log_evidence;
}

MatrixXd smooth_functions(const rig::SessionProblem& problem) {
  const auto motions = motions_of(problem.session());
  const auto count = static_cast<Index>(smooth_values({}).size());
  constexpr std::array pressures{rig::Signal::cavity, rig::Signal::pump};
  MatrixXd functions =
      MatrixXd::Zero(problem.features().count(), count * static_cast<Index>(pressures.size()));
  for (const rig::FeatureBlock& block : problem.features().blocks()) {
    const auto channel = std::ranges::find(pressures, block.signal) - pressures.begin();
    if (channel == static_cast<std::ptrdiff_t>(pressures.size())) continue;
    MatrixXd values(block.rows, count);
    for (Index k = 0; k < block.rows; ++k) {
      const std::vector<double> at =
          smooth_values(motions[block.run][block.first_row + static_cast<size_t>(k)]);
      values.row(k) = Eigen::Map<const Eigen::RowVectorXd>(at.data(), count);
    }
    functions.block(static_cast<Index>(block.first), channel * count,
                    static_cast<Index>(block.features.size()), count) =
        rig::SegmentFeatures::project(block, values);
  }
  return functions;
}

LinearFeatures smooth_discrepancy(const EffectSet& plain, const MatrixXd& functions, size_t count,
                                  const std::vector<Index>& rows) {
  // What functions and misfit have beyond the nuisances, in sds.
  const VectorXd target = plain.target();
  const VectorXd weight = plain.evidence.variance(rows).cwiseInverse();
  const MatrixXd nuisances = plain.columns(rows, Eigen::all), some = functions(rows, Eigen::all);
  const MatrixXd weighted = weight.asDiagonal() * nuisances;
  MatrixXd precision = weighted.transpose() * nuisances;
  precision.diagonal().array() += 1.0;
  const Eigen::LLT<MatrixXd> factor(precision);
  const MatrixXd mixed = weighted.transpose() * some;
  const MatrixXd products =
      some.transpose() * weight.asDiagonal() * some - mixed.transpose() * factor.solve(mixed);
  const VectorXd misfit = target(rows);
  const VectorXd along = some.transpose() * weight.cwiseProduct(misfit) -
                         mixed.transpose() * factor.solve(weighted.transpose() * misfit);
  std::vector<Index> chosen;
  VectorXd sizes;
  while (chosen.size() < count) {
    double best = 0.0;
    std::vector<Index> best_list;
    for (Index j = 0; j < functions.cols(); ++j) {
      std::vector<Index> list = chosen;
      list.push_back(j);
      if (std::ranges::count(chosen, j) > 0) continue;
      constexpr double apart = 1e-9;  // of its square, that is beyond the others
      const Eigen::LDLT<MatrixXd> trial(products(list, list));
      if (!(trial.vectorD().minCoeff() > apart * some.col(j).cwiseAbs2().dot(weight))) continue;
      const VectorXd found = trial.solve(along(list));
      if (const double gain = found.dot(along(list)); gain > best) {
        best = gain;
        best_list = list;
        sizes = found;
      }
    }
    if (best_list.empty()) break;
    chosen = best_list;
  }
  if (chosen.empty()) return {target, plain.columns};
  // A size is before the data what it was found to be, as an effect's.
  const MatrixXd columns = functions(Eigen::all, chosen) * sizes.asDiagonal();
  LinearFeatures with{target - columns.rowwise().sum(),
                      MatrixXd(functions.rows(), columns.cols() + plain.columns.cols())};
  with.columns << columns, plain.columns;
  return with;
}

HeldOutGain held_out_gain(const rig::SessionProblem& problem, const EffectSet& plain, const EffectSet& set) {
  HeldOutGain gain;
  const auto noted = [&](rig::EvidenceFit fit) {
    gain.termination = inference::of_both(gain.termination, fit.termination);
    return fit;
  };
  const auto freedom = [](const EffectSet& of) {
    size_t count = of.model.values.size();
    for (const rig::ModelTerm& term : of.model.terms)
      count += term.change_points.size();
    return count;
  };
  const size_t values = freedom(set) - freedom(plain);
  const auto effects = static_cast<double>(set.model.terms.size() - plain.model.terms.size());
  const auto of_its_parts = [&](const EffectSet& near, const VectorXd& u) {
    return std::log(std::max(strain_by_chance(problem, near.model, u), std::numeric_limits<double>::min()));
  };
  const auto of_fold = [&](const LinearFeatures& of, const EffectSet& near,
                           const std::vector<Index>& others) {
    const rig::ModelError error = error_of_rows(problem.error(), others);
    const rig::EvidenceFit fit = noted(
        fit_with_shares(of.target(others), of.columns(others, Eigen::all), error, near.evidence.shares));
    return held_out_density(of, problem.error(), others, fit.shares);
  };
  const MatrixXd functions = smooth_functions(problem);
  std::vector<Index> all(static_cast<size_t>(problem.features().count()));
  std::iota(all.begin(), all.end(), Index{0});
  const LinearFeatures of_all = smooth_discrepancy(plain, functions, values, all);
  double with = of_its_parts(set, set.evidence.estimate);
  double without = of_its_parts(plain, plain.evidence.estimate);
  const rig::EvidenceFit fit_of_all =
      noted(fit_with_shares(of_all.target, of_all.columns, problem.error(), plain.evidence.shares));
  double smooth = of_its_parts(plain, fit_of_all.estimate) + effects * std::log(effect_odds);
  const std::vector<Fold> folds = folds_of(problem);
  for (const Fold& fold : folds) {
    const std::vector<Index> others = fold.others();
    with += of_fold(features_of(set), set, others);
    without += of_fold(features_of(plain), plain, others);
    // A single waveform has no others to choose by.
    smooth += of_fold(folds.size() > 1 ? smooth_discrepancy(plain, functions, values, others) : of_all, plain,
                      others);
  }
  gain.log_pseudo_bayes_factor = with - std::max(without, smooth);
  return gain;
}

double log_mean(const std::vector<double>& logarithms) {
  const double largest = std::ranges::max(logarithms);
  double sum = 0.0;
  for (const double logarithm : logarithms)
    sum += std::exp(logarithm - largest);
  return largest + std::log(sum / static_cast<double>(logarithms.size()));
}

}  // namespace diastole::explain
