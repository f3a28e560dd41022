#include "estimator/explain/rig/event_scan.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>
#include <utility>

#include "estimator/parallel/parallel_for.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr size_t most_moments = 12;
constexpr double spacing_s = 0.5;     ///< of the moments that are tried first
constexpr double finest_s = 0.003;    ///< a sample
constexpr double worth_moving = 0.5;  ///< of 2 ln likelihood

struct Moment {
  size_t run = 0;
  double time_s = 0.0;
};

class EventScan {
 public:
  EventScan(const rig::SessionProblem& problem, const EffectSet& before, const Effect& effect)
      : problem_(problem),
        before_(before),
        effect_(effect),
        lasts_(effect.change_points() == ChangePoints::one) {
    const VectorXd weight = before.evidence.variance.cwiseSqrt().cwiseInverse();
    weight_ = weight;
    known_ = weight.asDiagonal() * before.columns;
    factor_.compute(before.evidence.precision);
    misfit_ = weight.cwiseProduct(before.evidence.left + before.columns * before.evidence.estimate);
    pulled_ = factor_.solve(known_.transpose() * misfit_);
    set_lasting();
  }
  std::optional<rig::SessionModel> run();

 private:
  struct Gain {
    double gain = 0.0;
    double amplitude = 0.0;
  };
  void set_lasting();
  [[nodiscard]] bool is_later(size_t run, size_t than) const {
    const auto start = [&](size_t r) { return problem_.session().runs[r].drive.place.started_s; };
    return start(run) > start(than);
  }
  [[nodiscard]] ChangePoint change_point(const Moment& moment) const {
    const rig::RunPlace& place = problem_.session().runs[moment.run].drive.place;
    return {place.name, moment.time_s, place.started_s + moment.time_s};
  }
  /// Whitened, of the features from each moment on.
  [[nodiscard]] MatrixXd changes(const std::vector<Moment>& moments) const;
  /// Of each of the changes beside what has been found.
  [[nodiscard]] std::vector<Gain> gains(const VectorXd& found, const MatrixXd& changes) const;
  /// The best of them.
  [[nodiscard]] std::pair<Moment, Gain> best(const VectorXd& found, const std::vector<Moment>& among,
                                             const MatrixXd& changes) const;
  /// From a moment to the best one near it.
  [[nodiscard]] std::pair<Moment, Gain> refined(const VectorXd& found, Moment moment) const;

  const rig::SessionProblem& problem_;
  const EffectSet& before_;
  const Effect& effect_;
  bool lasts_;
  std::vector<double> values_;                                         ///< of the effect as it was simulated
  std::map<std::pair<size_t, rig::Signal>, Eigen::VectorXd> lasting_;  ///< by run
  VectorXd whole_;  ///< change of the features, if the effect is there from each run's start
  VectorXd weight_, misfit_, pulled_;
  MatrixXd known_;
  Eigen::LLT<MatrixXd> factor_;
};

void EventScan::set_lasting() {
  constexpr double part = 0.3;
  for (const EffectParameter& parameter : effect_.parameters())
    values_.push_back(parameter.typical);
  values_[0] *= part;
  rig::SessionModel with = before_.model;
  with.terms.push_back({&effect_, {}});
  with.values.insert(with.values.end(), values_.begin(), values_.end());
  const auto& runs = problem_.session().runs;
  std::vector<size_t> order(runs.size());
  for (size_t r = 0; r < runs.size(); ++r)
    order[r] = r;
  std::ranges::sort(order, {}, [&](size_t r) { return runs[r].drive.place.started_s; });
  for (const size_t r : order) {
    with.terms.back().change_points.push_back(change_point({r, runs[r].sample_s.front() - 10.0}));
    if (lasts_) break;
  }
  std::vector<rig::RunPrediction> there(runs.size()), here(runs.size());
  parallel_for(2 * runs.size(), problem_.threads(), [&](size_t i) {
    const size_t r = i / 2;
    (i % 2 == 0 ? there : here)[r] = problem_.predict_run(r, i % 2 == 0 ? with : before_.model);
  });
  const auto difference = [](const std::vector<double>& a, const std::vector<double>& b) {
    return VectorXd(Eigen::Map<const VectorXd>(a.data(), static_cast<Index>(a.size())) -
                    Eigen::Map<const VectorXd>(b.data(), static_cast<Index>(b.size())));
  };
  for (size_t r = 0; r < runs.size(); ++r) {
    lasting_[{r, rig::Signal::cavity}] =
        difference(there[r].pressures.cavity_kPa, here[r].pressures.cavity_kPa);
    lasting_[{r, rig::Signal::pump}] = difference(there[r].pressures.pump_kPa, here[r].pressures.pump_kPa);
  }
  whole_ = VectorXd::Zero(problem_.features().count());
  for (const rig::FeatureBlock& block : problem_.features().blocks())
    if (block.signal != rig::Signal::volume)
      whole_.segment(static_cast<Index>(block.first), static_cast<Index>(block.features.size())) =
          rig::SegmentFeatures::project(block, lasting_.at({block.run, block.signal})
                                                   .segment(static_cast<Index>(block.first_row), block.rows));
}

MatrixXd EventScan::changes(const std::vector<Moment>& moments) const {
  MatrixXd out = MatrixXd::Zero(problem_.features().count(), static_cast<Index>(moments.size()));
  for (const rig::FeatureBlock& block : problem_.features().blocks()) {
    if (block.signal == rig::Signal::volume) continue;
    const auto& samples = problem_.session().runs[block.run].sample_s;
    const auto first_feature = static_cast<Index>(block.first);
    const auto features = static_cast<Index>(block.features.size());
    // What each function holds of the change from a moment's row on: sums from the end.
    std::vector<std::pair<Index, Index>> inside;  // row, moment
    for (size_t i = 0; i < moments.size(); ++i) {
      const Moment& moment = moments[i];
      const bool here = block.run == moment.run;
      const auto row = std::ranges::lower_bound(samples, moment.time_s) - samples.begin() -
                       static_cast<Index>(block.first_row);
      if (here ? row <= 0 : lasts_ && is_later(block.run, moment.run))
        out.col(static_cast<Index>(i)).segment(first_feature, features) =
            whole_.segment(first_feature, features);
      else if (here && row < block.rows)
        inside.emplace_back(row, static_cast<Index>(i));
    }
    if (inside.empty()) continue;
    std::ranges::sort(inside, std::greater());
    const auto first = static_cast<Index>(block.first_row);
    const VectorXd values = lasting_.at({block.run, block.signal}).segment(first, block.rows);
    MatrixXd sums(features, static_cast<Index>(inside.size()));
    parallel_for(block.basis.size(), problem_.threads(), [&](size_t j) {
      const rig::FeatureBlock::Function& function = block.basis[j];
      double sum = 0.0;
      Index to = function.first + function.values.size();
      for (size_t i = 0; i < inside.size(); ++i) {
        const Index from = std::max(inside[i].first, function.first);
        if (from < to) {
          sum += function.values.segment(from - function.first, to - from)
                     .cast<double>()
                     .dot(values.segment(from, to - from));
          to = from;
        }
        sums(static_cast<Index>(j), static_cast<Index>(i)) = sum;
      }
    });
    block.factor.triangularView<Eigen::Lower>().solveInPlace(sums);
    for (size_t i = 0; i < inside.size(); ++i)
      out.col(inside[i].second).segment(first_feature, features) = sums.col(static_cast<Index>(i));
  }
  return weight_.asDiagonal() * out;
}

std::vector<EventScan::Gain> EventScan::gains(const VectorXd& found, const MatrixXd& changes) const {
  const MatrixXd all = changes.colwise() + found;
  const MatrixXd mixed = known_.transpose() * all;
  const MatrixXd solved = factor_.solve(mixed);
  std::vector<Gain> list(static_cast<size_t>(all.cols()));
  for (Index i = 0; i < all.cols(); ++i) {
    const double along = all.col(i).dot(misfit_) - mixed.col(i).dot(pulled_);
    const double norm = all.col(i).squaredNorm();
    const double square = norm - mixed.col(i).dot(solved.col(i));
    if (square > 1e-6 * norm) list[static_cast<size_t>(i)] = {along * along / square, along / square};
  }
  return list;
}

std::pair<Moment, EventScan::Gain> EventScan::best(const VectorXd& found, const std::vector<Moment>& among,
                                                   const MatrixXd& changes) const {
  const std::vector<Gain> list = gains(found, changes);
  const auto at = std::ranges::max_element(list, {}, &Gain::gain);
  return {among[static_cast<size_t>(at - list.begin())], *at};
}

std::pair<Moment, EventScan::Gain> EventScan::refined(const VectorXd& found, Moment moment) const {
  Gain gained;
  for (double spacing = 0.5 * spacing_s; spacing > finest_s; spacing *= 0.5) {
    std::vector<Moment> near;
    for (const double by : {-2.0, -1.0, 0.0, 1.0, 2.0})
      near.push_back({moment.run, moment.time_s + by * spacing});
    std::tie(moment, gained) = best(found, near, changes(near));
  }
  return {moment, gained};
}

std::optional<rig::SessionModel> EventScan::run() {
  std::vector<Moment> everywhere;
  for (size_t r = 0; r < problem_.session().runs.size(); ++r) {
    const auto& samples = problem_.session().runs[r].sample_s;
    for (double t = samples.front() + spacing_s; t < samples.back(); t += spacing_s)
      everywhere.push_back({r, t});
  }
  const MatrixXd everywhere_changes = changes(everywhere);
  // Among so many independent moments chance gains 2 ln of their number; a name asks for more (set_fit.cpp).
  const double chance = 2.0 * std::log(static_cast<double>(everywhere.size()));
  const double least = 2.0 * std::log(1.0 / effect_odds);
  VectorXd sum = VectorXd::Zero(problem_.features().count());
  std::vector<Moment> found;
  Gain so_far;
  while (found.size() < (lasts_ ? 1 : most_moments)) {
    auto [moment, gained] = best(sum, everywhere, everywhere_changes);
    std::tie(moment, gained) = refined(sum, moment);
    if (gained.gain < so_far.gain + chance + (found.empty() ? least : 0.0)) break;
    so_far = gained;
    found.push_back(moment);
    sum += changes({moment}).col(0);
    // Each again beside the others, until all rest.
    for (bool moved = found.size() > 1; moved;) {
      moved = false;
      for (Moment& one : found) {
        const VectorXd others = sum - changes({one}).col(0);
        const auto [better, gained_there] = refined(others, one);
        if (!(gained_there.gain > so_far.gain + worth_moving)) continue;
        one = better;
        so_far = gained_there;
        sum = others + changes({one}).col(0);
        moved = true;
      }
    }
  }
  if (found.empty()) return {};
  rig::SessionModel start = before_.model;
  start.terms.push_back({&effect_, {}});
  for (const Moment& moment : found)
    start.terms.back().change_points.push_back(change_point(moment));
  values_[0] *= so_far.amplitude;
  for (size_t j = 0; j < values_.size(); ++j)
    values_[j] = std::clamp(values_[j], effect_.parameters()[j].lower, effect_.parameters()[j].upper);
  start.values.insert(start.values.end(), values_.begin(), values_.end());
  return start;
}

}  // namespace

std::optional<rig::SessionModel> scan_events(const rig::SessionProblem& problem, const EffectSet& before,
                                             const Effect& effect) {
  return EventScan(problem, before, effect).run();
}

}  // namespace diastole::explain
