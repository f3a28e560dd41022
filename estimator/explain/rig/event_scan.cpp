#include "estimator/explain/rig/event_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "estimator/parallel/parallel_for.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr size_t most_moments = 12;
constexpr double spacing_s = 0.5;  ///< of the moments that are tried first
constexpr double finest_s = 0.03;

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
    misfit_ = weight.cwiseProduct(before.evidence.left + before.columns * before.evidence.u);
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
  /// Whitened change of the features from the moment on.
  [[nodiscard]] VectorXd change(const Moment& moment) const;
  /// A block's change from a time on.
  [[nodiscard]] VectorXd partial(const rig::FeatureBlock& block, double time_s) const;
  [[nodiscard]] Gain gain(const VectorXd& change) const {
    const VectorXd mixed = known_.transpose() * change;
    const double along = change.dot(misfit_) - mixed.dot(pulled_);
    const double square = change.squaredNorm() - mixed.dot(factor_.solve(mixed));
    if (!(square > 1e-6 * change.squaredNorm()) || square == 0.0) return {};
    return {along * along / square, along / square};
  }
  /// The best moment beside those found, near `about` within `reach` or anywhere.
  [[nodiscard]] std::pair<Moment, Gain> best(const VectorXd& found, const std::vector<Moment>& among) const;

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
  for (size_t r = 0; r < runs.size(); ++r) {
    const rig::Shown there = problem_.shown_in(r, with);
    const rig::Shown here = problem_.shown_in(r, before_.model);
    const auto difference = [](const std::vector<double>& a, const std::vector<double>& b) {
      Eigen::VectorXd values(static_cast<Index>(a.size()));
      for (size_t k = 0; k < a.size(); ++k)
        values[static_cast<Index>(k)] = a[k] - b[k];
      return values;
    };
    lasting_[{r, rig::Signal::cavity}] = difference(there.pressures.cavity_kPa, here.pressures.cavity_kPa);
    lasting_[{r, rig::Signal::pump}] = difference(there.pressures.pump_kPa, here.pressures.pump_kPa);
  }
  whole_ = VectorXd::Zero(problem_.features().count());
  for (const rig::FeatureBlock& block : problem_.features().blocks())
    if (block.signal != rig::Signal::volume)
      whole_.segment(static_cast<Index>(block.first), static_cast<Index>(block.features.size())) =
          partial(block, -std::numeric_limits<double>::infinity());
}

VectorXd EventScan::change(const Moment& moment) const {
  VectorXd out = VectorXd::Zero(problem_.features().count());
  for (const rig::FeatureBlock& block : problem_.features().blocks()) {
    const auto first_feature = static_cast<Index>(block.first);
    const auto features = static_cast<Index>(block.features.size());
    if (block.signal == rig::Signal::volume) continue;
    const bool here = block.run == moment.run;
    const auto& times = problem_.session().runs[block.run].sample_s;
    if (here ? times[block.first_row] >= moment.time_s : lasts_ && is_later(block.run, moment.run)) {
      out.segment(first_feature, features) = whole_.segment(first_feature, features);
      continue;
    }
    if (!here || times[block.first_row + static_cast<size_t>(block.basis.rows()) - 1] < moment.time_s)
      continue;
    out.segment(first_feature, features) = partial(block, moment.time_s);
  }
  return out.cwiseProduct(weight_);
}

VectorXd EventScan::partial(const rig::FeatureBlock& block, double time_s) const {
  const auto& samples = problem_.session().runs[block.run].sample_s;
  const auto first = static_cast<Index>(block.first_row);
  VectorXd values = lasting_.at({block.run, block.signal}).segment(first, block.basis.rows());
  const auto from = std::ranges::lower_bound(samples, time_s) - samples.begin() - first;
  values.head(std::clamp<Index>(from, 0, values.size())).setZero();
  return rig::SegmentFeatures::project(block, values);
}

std::pair<Moment, EventScan::Gain> EventScan::best(const VectorXd& found,
                                                   const std::vector<Moment>& among) const {
  std::vector<Gain> gains(among.size());
  parallel_for(among.size(), problem_.threads(),
               [&](size_t i) { gains[i] = gain(found + change(among[i])); });
  const auto at = std::ranges::max_element(gains, {}, &Gain::gain);
  return {among[static_cast<size_t>(at - gains.begin())], *at};
}

std::optional<rig::SessionModel> EventScan::run() {
  std::vector<Moment> everywhere;
  for (size_t r = 0; r < problem_.session().runs.size(); ++r) {
    const auto& samples = problem_.session().runs[r].sample_s;
    for (double t = samples.front() + spacing_s; t < samples.back(); t += spacing_s)
      everywhere.push_back({r, t});
  }
  // Among so many independent moments chance gains 2 ln of their number; a name asks for more (set_fit.cpp).
  const double chance = 2.0 * std::log(static_cast<double>(everywhere.size()));
  const double least = 2.0 * std::log(1.0 / effect_odds);
  VectorXd sum = VectorXd::Zero(problem_.features().count());
  std::vector<Moment> found;
  Gain so_far;
  while (found.size() < (lasts_ ? 1 : most_moments)) {
    auto [moment, gained] = best(sum, everywhere);
    for (double spacing = 0.5 * spacing_s; spacing > finest_s; spacing *= 0.5) {
      const auto [finer, gained_there] =
          best(sum, {{moment.run, moment.time_s - spacing}, moment, {moment.run, moment.time_s + spacing}});
      moment = finer;
      gained = gained_there;
    }
    if (gained.gain < so_far.gain + chance + (found.empty() ? least : 0.0)) break;
    so_far = gained;
    found.push_back(moment);
    sum += change(moment);
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
