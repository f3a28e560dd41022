#include "estimator/explain/rig/effect_sets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <tuple>

#include "estimator/explain/rig/changed_parts.hpp"
#include "estimator/explain/rig/event_scan.hpp"
#include "estimator/explain/rig/fitted_part.hpp"
#include "estimator/explain/rig/part_strain.hpp"
#include "estimator/explain/rig/screening.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/explain/rig/synergy_scan.hpp"
#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using rig::SessionModel;

constexpr size_t singles_fitted = 6;
constexpr size_t pairs_fitted = 4;
constexpr size_t seconds_fitted = 3;  ///< beside the best single effect that was fitted
constexpr double second_in_reach =
    50.0;  ///< nats behind the best of its size, beyond which a set is not taken again
constexpr size_t refitted_sets = 2;  ///< best sets of each size, fitted with tolerances that are not linear
class SetSearch {
 public:
  SetSearch(const rig::SessionProblem& problem, const SetSearchOptions& options)
      : problem_(problem), options_(options) {}
  WeighedSets run();

 private:
  void report(std::string_view what) const {
    if (options_.progress) options_.progress(what);
  }
  /// Effects beyond those that every set has.
  [[nodiscard]] size_t added(const EffectSet& set) const {
    return set.model.terms.size() - options_.terms.size();
  }
  void fit(const std::vector<size_t>& responses);
  /// From `start`, near a model that is known.
  [[nodiscard]] EffectSet fitted(const SessionModel& start, const rig::LinearisedModel& known,
                                 const rig::Shares& shares) const {
    // A rig that is finer than described is so in what an effect changes, too: the effect says all that is wrong with it.
    const FreedStart free =
        is_finer() ? FreedStart{start, known} : free_changed_parts(problem_, start, known);
    return fit_set(problem_, free.start, free.known, shares, best_posterior());
  }
  void fit(const SessionModel& start, const rig::LinearisedModel& known, const rig::Shares& shares) {
    sets_.push_back(fitted(start, known, shares));
  }
  [[nodiscard]] double best_posterior() const {
    double best = best_described_;
    for (const EffectSet& set : sets_)
      best = std::max(best, set.log_posterior);
    return best;
  }
  /// Are the base's parts finer than described?
  [[nodiscard]] bool is_finer() const { return base_.at.prior != nullptr; }
  /// Is it so far behind what the rig as described has that no further fit brings it near?
  [[nodiscard]] bool is_behind(const EffectSet& set) const {
    return set.log_posterior < best_described_ - second_in_reach;
  }
  void fit_events(const EffectSet& beside, const Effect& effect);
  void fit_beside_best();
  void fit_synergies();
  void fit_from_better_part(const std::vector<size_t>& responses);
  void fit_best_again(size_t effects);
  /// The most probable set of so many effects; null if there is none.
  [[nodiscard]] const EffectSet* best_of(size_t effects) const {
    const EffectSet* best = nullptr;
    for (const EffectSet& set : sets_)
      if (added(set) == effects && (best == nullptr || set.log_posterior > best->log_posterior)) best = &set;
    return best;
  }
  void search_from_base();
  void take_base_for_finer(double times);
  [[nodiscard]] double posterior_if_finer(double times, const EffectSet& plain) const;
  void search_if_finer();
  void fit_plain_and_singles_again();
  [[nodiscard]] bool is_plain_near() const;
  [[nodiscard]] bool is_plain_in_reach() const;
  [[nodiscard]] bool is_fitted(const std::vector<const Effect*>& effects) const;
  /// From the base.
  [[nodiscard]] std::vector<ScreenedSet> screened_sets(const rig::EvidenceFit& under, bool pairs) const {
    return Screening(responses_, base_.target(problem_), base_.columns, under).sets(pairs);
  }
  /// The most probable first; what has no solution is no set.
  void sort_sets() {
    std::erase_if(sets_, [](const EffectSet& set) { return !std::isfinite(set.log_posterior); });
    std::ranges::sort(sets_, std::greater(), &EffectSet::log_posterior);
  }

  const rig::SessionProblem& problem_;
  const SetSearchOptions& options_;
  rig::LinearisedModel base_;  ///< the rig as declared
  double best_described_ =
      -std::numeric_limits<double>::infinity();  ///< log posterior, once finer parts are tried
  std::vector<Response> responses_;
  std::vector<EffectSet> sets_;
};

bool SetSearch::is_fitted(const std::vector<const Effect*>& effects) const {
  return std::ranges::any_of(sets_, [&](const EffectSet& set) {
    return added(set) == effects.size() &&
           std::ranges::all_of(
               std::span(set.model.terms).subspan(options_.terms.size()),
               [&](const rig::ModelTerm& term) { return std::ranges::count(effects, term.effect) > 0; });
  });
}

void SetSearch::fit(const std::vector<size_t>& responses) {
  SessionModel start = base_.at;
  std::vector<const Effect*> effects;
  for (const size_t i : responses) {
    const Response& response = responses_[i];
    const auto same = std::ranges::find(effects, response.term.effect);
    if (same == effects.end()) {
      effects.push_back(response.term.effect);
      start.terms.push_back(response.term);
      start.values.insert(start.values.end(), response.values.begin(), response.values.end());
      continue;
    }
    // Another variant of an effect that is in: the amplitudes that grow in it.
    size_t at = start.values.size() - response.values.size();
    for (size_t j = 0; j < response.values.size(); ++j, ++at)
      if (is_amplitude(*response.term.effect, j))
        start.values[at] = std::max(start.values[at], response.values[j]);
  }
  if (is_fitted(effects)) return;
  fit(start, base_, problem_.error().prior.share);
  if (effects.size() == 2) fit_from_better_part(responses);
}

/// A pair that explains less than one of its effects alone has lost its way: it is searched again from that one.
void SetSearch::fit_from_better_part(const std::vector<size_t>& responses) {
  const EffectSet& pair = sets_.back();
  const EffectSet* better = nullptr;
  size_t other = 0;
  for (const EffectSet& set : sets_) {
    if (added(set) != 1 || set.evidence.log_evidence <= (better ? *better : pair).evidence.log_evidence)
      continue;
    const bool is_first = set.model.terms.back().effect == responses_[responses.front()].term.effect;
    const bool is_last = set.model.terms.back().effect == responses_[responses.back()].term.effect;
    if (!is_first && !is_last) continue;
    better = &set;
    other = is_first ? responses.back() : responses.front();
  }
  if (better == nullptr) return;
  SessionModel start = better->model;
  start.terms.push_back(responses_[other].term);
  start.values.insert(start.values.end(), responses_[other].values.begin(), responses_[other].values.end());
  EffectSet again = fitted(start, better->known, better->evidence.shares);
  if (again.log_posterior > sets_.back().log_posterior) sets_.back() = std::move(again);
}

/// An effect with moments beside a set. How many there are, and when, shows as finely as the model is right, which the fit with some
/// of them shows: they are sought under what the set leaves, under what is stated if that is finer, and again under what is left with
/// the best ones.
void SetSearch::fit_events(const EffectSet& beside, const Effect& effect) {
  EffectSet before = beside;
  std::optional<EffectSet> best;
  const auto seek = [&](const rig::Shares& shares) {
    before.evidence = fit_linear(beside.target(), beside.columns, problem_.error(), shares);
    const auto start = scan_events(problem_, before, effect);
    if (!start || (best && best->model.terms.back().change_points == start->terms.back().change_points))
      return false;
    EffectSet found = fitted(*start, beside.known, shares);
    if (best && !(found.log_posterior > best->log_posterior)) return false;
    best = std::move(found);
    return true;
  };
  const rig::Shares& left = beside.evidence.shares;
  rig::Shares finer = left;
  std::ranges::transform(left, problem_.error().prior.share, finer.begin(), std::ranges::min);
  seek(left);
  if (best && best->log_posterior > beside.log_posterior) {
    if (finer != left) seek(finer);
    while (seek(best->evidence.shares)) {
    }
  }
  if (best) sets_.push_back(std::move(*best));
}

void SetSearch::fit_beside_best() {
  sort_sets();
  const EffectSet* best = best_of(1);
  if (best == nullptr) return;
  const EffectSet first = *best;
  const Screening screening(responses_, first.target(), first.columns, first.evidence);
  size_t count = 0;
  for (const ScreenedSet& candidate : screening.singles_but(first.model.terms.back().effect)) {
    if (++count > seconds_fitted || candidate.gain < least_gain) break;
    const Response& response = responses_[candidate.responses.front()];
    if (is_fitted({first.model.terms.back().effect, response.term.effect})) continue;
    SessionModel start = first.model;
    start.terms.push_back(response.term);
    start.values.insert(start.values.end(), response.values.begin(), response.values.end());
    fit(start, first.known, first.evidence.shares);
  }
  for (const Effect* effect : problem_.session().effects.of_rig()) {
    if (effect->change_points() == ChangePoints::none || effect == first.model.terms.back().effect) continue;
    fit_events(first, *effect);
  }
}

/// Pairs whose effects only show together, where what has been found leaves more than the model's error is likely to be.
void SetSearch::fit_synergies() {
  sort_sets();
  if (sets_.empty() ||
      std::ranges::max(sets_.front().evidence.surprise(problem_.error().prior)) < surprising_sds)
    return;
  for (const SessionModel& start : scan_synergies(problem_, base_)) {
    const std::span added_terms = std::span(start.terms).subspan(options_.terms.size());
    if (!is_fitted({added_terms[0].effect, added_terms[1].effect}))
      fit(start, base_, problem_.error().prior.share);
  }
}

void SetSearch::fit_best_again(size_t effects) {
  sort_sets();
  size_t count = 0;
  double best = 0.0;
  for (EffectSet& set : sets_) {
    if (added(set) != effects) continue;
    if (is_behind(set) || ++count > refitted_sets ||
        (count > 1 && set.log_posterior < best - second_in_reach))
      break;
    if (const auto posterior = posterior_by_part(set, sets_, responses_)) {
      set.log_posterior = *posterior;
      set.by_part = true;
    } else {
      set = fit_set_exactly(problem_, set);
    }
    if (count == 1) best = set.log_posterior;
  }
  sort_sets();
}

/// Is the rig without effects, which is among the sets, as probable as the best of one, or in the reach of what another fit changes?
bool SetSearch::is_plain_near() const {
  const EffectSet* best = best_of(1);
  return best == nullptr || best_of(0)->log_posterior >= best->log_posterior - second_in_reach;
}

/// May it come near once its tolerances are not linear? At the best set's tolerances, linear algebra shows it. Without effects a search
/// goes a long way after what tolerances cannot make.
bool SetSearch::is_plain_in_reach() const {
  if (is_plain_near()) return true;
  const EffectSet& best = *best_of(1);
  SessionModel start = best.model;
  start.terms.resize(options_.terms.size());
  start.values.resize(options_.values.size());
  const double least = best.log_posterior - second_in_reach;
  return fit_set(problem_, start, best.known, best.evidence.shares, least).log_posterior >= least;
}

/// Beside the rig without effects most sets need no fit of their own, so it comes first where it is near. Where its tolerances
/// wandered further than is likely, what it found counts only if it is in reach once effects are fitted; where they found no end,
/// their linear fit stands.
void SetSearch::fit_plain_and_singles_again() {
  const auto plain = [&] {
    return std::ranges::find_if(sets_, [&](const EffectSet& set) { return added(set) == 0; });
  };
  const auto may_count = [&] { return plain() != sets_.end() && !is_behind(*plain()); };
  const auto replace = [&](EffectSet again) {
    if (inference::is_settled(again.termination)) *plain() = std::move(again);
  };
  sort_sets();
  std::optional<EffectSet> again;
  if (may_count() && is_plain_near()) again = fit_set_exactly(problem_, *plain());
  const bool is_likely = again && !is_strained(problem_, *again);
  if (is_likely) replace(*again);
  fit_best_again(1);
  if (!is_likely && may_count() && is_plain_in_reach())
    replace(again ? std::move(*again) : fit_set_exactly(problem_, *plain()));
}

/// All sets that promise most, from the base and the effects' responses.
void SetSearch::search_from_base() {
  sets_.push_back(fit_set(problem_, base_.at, base_, problem_.error().prior.share));
  const EffectSet plain = sets_.front();
  const rig::EvidenceFit stated =
      fit_linear(base_.target(problem_), base_.columns, problem_.error(), problem_.error().prior.share);
  const rig::EvidenceFit adapted =
      fit_linear(base_.target(problem_), base_.columns, problem_.error(), plain.evidence.shares);
  report("fitting the effects that promise most");
  for (const rig::EvidenceFit* under : {&stated, &adapted}) {
    const std::vector<ScreenedSet> singles = screened_sets(*under, false);
    for (size_t i = 0; i < std::min(singles_fitted, singles.size()); ++i)
      if (is_worth_fitting(singles, i, least_gain)) fit(singles[i].responses);
  }
  for (const Effect* effect : problem_.session().effects.of_rig())
    if (effect->change_points() != ChangePoints::none) fit_events(plain, *effect);
  report("fitting the best of them again");
  fit_plain_and_singles_again();
  report("fitting the pairs that promise most");
  for (const rig::EvidenceFit* under : {&stated, &adapted}) {
    const std::vector<ScreenedSet> singles = screened_sets(*under, false);
    const std::vector<ScreenedSet> pairs = screened_sets(*under, true);
    const double least = least_gain + std::max(least_gain, singles.empty() ? 0.0 : singles.front().gain);
    for (size_t i = 0; i < std::min(pairs_fitted / 2, pairs.size()); ++i)
      if (is_worth_fitting(pairs, i, least)) fit(pairs[i].responses);
  }
  fit_beside_best();
  fit_synergies();
  report("fitting the best pairs again");
  fit_best_again(2);
}

/// From now on the base is a rig whose parts are so many times finer.
void SetSearch::take_base_for_finer(double times) {
  const auto prior = std::make_shared<rig::TolerancePrior>(problem_.finer_prior(times));
  base_.columns.rightCols(prior->mean.size()) *= prior->described.asDiagonal();
  base_.at.prior = prior;
}

/// The log posterior that the best set would have in a rig of parts so many times finer: the rig without effects that was fitted, and
/// the responses, by linear algebra. What effects with moments would do is not among them.
double SetSearch::posterior_if_finer(double times, const EffectSet& plain) const {
  const rig::TolerancePrior finer = problem_.finer_prior(times);
  const VectorXd target = plain.target();
  MatrixXd columns = plain.columns;
  columns.rightCols(finer.mean.size()) *= finer.described.asDiagonal();
  const rig::EvidenceFit fit = fit_linear(target, columns, problem_.error(), plain.evidence.shares);
  const Screening screening(responses_, target, columns, fit);
  double most = 0.0;
  for (const bool pairs : {false, true}) {
    const std::vector<ScreenedSet> best = screening.sets(pairs);
    if (!best.empty()) most = std::max(most, 0.5 * (best.front().gain - (pairs ? 2.0 : 1.0) * least_gain));
  }
  return fit.log_evidence + most + plain.log_posterior - plain.evidence.log_evidence;
}

/// The list's tolerances are what rigs usually have. One whose parts are all far nearer to their description is as likely beforehand, and
/// in it a part that alone is off is no tolerance: the sets are sought there, too, where that may decide something.
void SetSearch::search_if_finer() {
  static constexpr std::array finer{2.0, 4.0, 8.0};
  constexpr double linear_errs = 10.0;  // nats, of a posterior by linear algebra
  const EffectSet* plain = best_of(0);
  if (problem_.is_learnt() || plain == nullptr) return;
  if (problem_.finer_prior(finer.front()).described.minCoeff() == 1.0) return;  // all sizes are stated
  const double log_odds = -std::log(static_cast<double>(finer.size()));
  double best = 0.0, most = -std::numeric_limits<double>::infinity();
  for (const double times : finer) {
    const double posterior = posterior_if_finer(times, *plain) + log_odds;
    if (posterior > most) std::tie(most, best) = std::pair(posterior, times);
  }
  if (most < best_posterior() - linear_errs) return;
  report("seeking the same in a rig of finer parts");
  take_base_for_finer(best);
  best_described_ = best_posterior();
  std::vector<EffectSet> described = std::move(sets_);
  sets_.clear();
  search_from_base();
  for (EffectSet& set : sets_)
    set.log_posterior += log_odds;
  std::ranges::move(described, std::back_inserter(sets_));
  sort_sets();
}

WeighedSets SetSearch::run() {
  report("fitting the rig's model");
  base_ = declared_rig(problem_, {.terms = options_.terms, .values = options_.values, .nuisances = {}});
  report("computing what each effect would do");
  const rig::EvidenceFit stated =
      fit_linear(base_.target(problem_), base_.columns, problem_.error(), problem_.error().prior.share);
  responses_ = effect_responses(problem_, base_, stated.variance.cwiseSqrt());
  WeighedSets found;
  found.given = options_.terms.size();
  for (const ScreenedSet& candidate : screened_sets(stated, false))
    found.single_gains.emplace_back(responses_[candidate.responses.front()].term.effect->text().id,
                                    candidate.gain);
  search_from_base();
  search_if_finer();
  double sum = 0.0;
  for (const EffectSet& set : sets_)
    sum += std::exp(set.log_posterior - sets_.front().log_posterior);
  for (const EffectSet& set : sets_)
    found.probability.push_back(std::exp(set.log_posterior - sets_.front().log_posterior) / sum);
  found.sets = std::move(sets_);
  return found;
}

}  // namespace

std::vector<std::string> EffectSet::ids() const {
  std::vector<std::string> list;
  for (const rig::ModelTerm& term : model.terms)
    list.emplace_back(term.effect->text().id);
  std::ranges::sort(list);
  return list;
}

WeighedSets search_sets(const rig::SessionProblem& problem, const SetSearchOptions& options) {
  return SetSearch(problem, options).run();
}

}  // namespace diastole::explain
