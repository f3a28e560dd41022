#include "estimator/explain/rig/effect_sets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>

#include "estimator/explain/rig/changed_parts.hpp"
#include "estimator/explain/rig/event_scan.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/explain/rig/set_verdict.hpp"
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
/// Of 2 ln likelihood by an effect, below which its prior odds alone speak against it.
const double least_promise = 2.0 * std::log(1.0 / effect_odds);
constexpr double second_in_reach =
    50.0;                      ///< nats behind the best of its size, beyond which a set is not taken again
constexpr size_t retaken = 2;  ///< best sets of each size that are fitted with tolerances that are not linear
constexpr double least_amplitude = 0.5,
                 most_amplitude = 2.0;  ///< of a response: beyond, another size stands for it

/// Responses that together promise a gain.
struct Promise {
  double gain = 0.0;  ///< of 2 ln likelihood
  std::vector<size_t> responses;
};

/// Promises are right within their sizes' spacing: what promises half of the best, or is among the first, may turn out best.
bool is_worth_fitting(const std::vector<Promise>& sorted, size_t i, double least) {
  constexpr size_t first = 3;
  return sorted[i].gain > least && (i < first || sorted[i].gain > 0.5 * sorted.front().gain);
}

/// Products of what responses and misfit have beyond the nuisances, in sds.
class Screening {
 public:
  Screening(const std::vector<Response>& responses, const VectorXd& misfit, const MatrixXd& columns,
            const rig::EvidenceFit& under) {
    const VectorXd weight = under.variance.cwiseSqrt().cwiseInverse();
    MatrixXd all(misfit.size(), static_cast<Index>(responses.size()) + 1);
    all.col(0) = misfit;
    for (size_t i = 0; i < responses.size(); ++i)
      all.col(static_cast<Index>(i) + 1) = responses[i].change;
    all = weight.asDiagonal() * all;
    const MatrixXd known = weight.asDiagonal() * columns;
    const MatrixXd mixed = known.transpose() * all;
    products_ = all.transpose() * all - mixed.transpose() * under.precision.llt().solve(mixed);
  }
  [[nodiscard]] double single(size_t i) const {
    const double a = amplitude(along(i), square(i));
    return a * (2.0 * along(i) - a * square(i));
  }
  /// Of any amplitude.
  [[nodiscard]] double best_single(size_t i) const {
    return along(i) > 0.0 && square(i) > 0.0 ? along(i) * along(i) / square(i) : 0.0;
  }
  [[nodiscard]] double pair(size_t i, size_t j) const {
    const double both = products_(static_cast<Index>(i) + 1, static_cast<Index>(j) + 1);
    double a = 1.0;
    double b = 1.0;
    for (int round = 0; round < 6; ++round) {  // of a box-bounded quadratic, from its middle
      a = amplitude(along(i) - b * both, square(i));
      b = amplitude(along(j) - a * both, square(j));
    }
    return 2.0 * (a * along(i) + b * along(j)) - a * a * square(i) - b * b * square(j) - 2.0 * a * b * both;
  }

 private:
  [[nodiscard]] double along(size_t i) const { return products_(0, static_cast<Index>(i) + 1); }
  [[nodiscard]] double square(size_t i) const {
    return products_(static_cast<Index>(i) + 1, static_cast<Index>(i) + 1);
  }
  static double amplitude(double along, double square) {
    return square > 0.0 ? std::clamp(along / square, least_amplitude, most_amplitude) : 1.0;
  }
  MatrixXd products_;
};

/// The best promise of each set of ids, the largest first.
class Promises {
 public:
  explicit Promises(const std::vector<Response>& responses) : responses_(responses) {}
  void add(Promise promise) {
    std::vector<std::string_view> ids;
    for (const size_t i : promise.responses)
      ids.push_back(responses_[i].term.effect->text().id);
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    Promise& best = best_[ids];
    if (promise.gain > best.gain) best = std::move(promise);
  }
  [[nodiscard]] std::vector<Promise> sorted() const {
    std::vector<Promise> list;
    for (const auto& [ids, promise] : best_)
      if (!promise.responses.empty()) list.push_back(promise);
    std::ranges::sort(list, std::greater(), &Promise::gain);
    return list;
  }

 private:
  const std::vector<Response>& responses_;
  std::map<std::vector<std::string_view>, Promise> best_;
};

class SetsSearch {
 public:
  SetsSearch(const rig::SessionProblem& problem, const SetSearchOptions& options)
      : problem_(problem), options_(options) {}
  SetSearch run();

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
  void fit(const SessionModel& start, const rig::LinearisedModel& known, const rig::Shares& shares) {
    const FreedStart free = free_changed_parts(problem_, start, known);
    sets_.push_back(fit_set(problem_, free.start, free.known, shares, best_posterior()));
  }
  [[nodiscard]] double best_posterior() const {
    double best = -std::numeric_limits<double>::infinity();
    for (const EffectSet& set : sets_)
      best = std::max(best, set.log_posterior);
    return best;
  }
  void fit_beside_best();
  void fit_synergies();
  void fit_from_better_part(const std::vector<size_t>& responses);
  void fit_best_again(size_t effects);
  [[nodiscard]] bool is_plain_in_reach() const;
  [[nodiscard]] bool relieves(const Effect* effect, const EffectSet& set) const;
  [[nodiscard]] std::optional<double> posterior_beside_part(const EffectSet& set) const;
  [[nodiscard]] bool is_fitted(const std::vector<const Effect*>& effects) const;
  [[nodiscard]] std::vector<Promise> promises(const rig::EvidenceFit& under, bool pairs) const;
  /// The most probable first; what has no solution is no set.
  void sort_sets() {
    std::erase_if(sets_, [](const EffectSet& set) { return !std::isfinite(set.log_posterior); });
    std::ranges::sort(sets_, std::greater(), &EffectSet::log_posterior);
  }

  const rig::SessionProblem& problem_;
  const SetSearchOptions& options_;
  rig::LinearisedModel base_;  ///< the rig as declared
  std::vector<Response> responses_;
  std::vector<EffectSet> sets_;
};

std::vector<Promise> SetsSearch::promises(const rig::EvidenceFit& under, bool pairs) const {
  const Screening screening(responses_, base_.target(problem_), base_.columns, under);
  Promises best(responses_);
  for (size_t i = 0; i < responses_.size(); ++i) {
    if (!pairs) best.add({screening.single(i), {i}});
    for (size_t j = i + 1; j < responses_.size(); ++j)
      if ((responses_[i].term.effect != responses_[j].term.effect) == pairs)
        best.add({screening.pair(i, j), {i, j}});
  }
  return best.sorted();
}

bool SetsSearch::is_fitted(const std::vector<const Effect*>& effects) const {
  return std::ranges::any_of(sets_, [&](const EffectSet& set) {
    return added(set) == effects.size() &&
           std::ranges::all_of(
               std::span(set.model.terms).subspan(options_.terms.size()),
               [&](const rig::ModelTerm& term) { return std::ranges::count(effects, term.effect) > 0; });
  });
}

void SetsSearch::fit(const std::vector<size_t>& responses) {
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
void SetsSearch::fit_from_better_part(const std::vector<size_t>& responses) {
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
  const rig::LinearisedModel known = better->known;
  const rig::Shares shares = better->evidence.shares;
  SessionModel start = better->model;
  start.terms.push_back(responses_[other].term);
  start.values.insert(start.values.end(), responses_[other].values.begin(), responses_[other].values.end());
  fit(start, known, shares);
  EffectSet again = std::move(sets_.back());
  sets_.pop_back();
  if (again.log_posterior > sets_.back().log_posterior) sets_.back() = std::move(again);
}

void SetsSearch::fit_beside_best() {
  sort_sets();
  const auto best = std::ranges::find_if(sets_, [&](const EffectSet& set) { return added(set) == 1; });
  if (best == sets_.end()) return;
  const EffectSet first = *best;
  const Screening screening(responses_, first.target(), first.columns, first.evidence);
  Promises promised(responses_);
  for (size_t i = 0; i < responses_.size(); ++i)
    if (responses_[i].term.effect != first.model.terms.back().effect)
      promised.add({screening.single(i), {i}});
  size_t count = 0;
  for (const Promise& promise : promised.sorted()) {
    if (++count > seconds_fitted || promise.gain < least_promise) break;
    const Response& response = responses_[promise.responses.front()];
    if (is_fitted({first.model.terms.back().effect, response.term.effect})) continue;
    SessionModel start = first.model;
    start.terms.push_back(response.term);
    start.values.insert(start.values.end(), response.values.begin(), response.values.end());
    fit(start, first.known, first.evidence.shares);
  }
  for (const Effect* effect : problem_.session().effects.of_rig()) {
    if (effect->change_points() == ChangePoints::none || effect == first.model.terms.back().effect) continue;
    if (const auto start = scan_events(problem_, first, *effect))
      fit(*start, first.known, first.evidence.shares);
  }
}

/// Pairs whose effects only show together, where what has been found leaves more than the model's error is likely to be.
void SetsSearch::fit_synergies() {
  sort_sets();
  if (sets_.empty() ||
      std::ranges::max(sets_.front().evidence.surprise(problem_.error().prior)) < least_surprise(1))
    return;
  for (const SessionModel& start : scan_synergies(problem_, base_)) {
    const std::span added_terms = std::span(start.terms).subspan(options_.terms.size());
    if (!is_fitted({added_terms[0].effect, added_terms[1].effect}))
      fit(start, base_, problem_.error().prior.share);
  }
}

/// Is more than half of what an effect changes what a tolerance changes that is so far off in a set that the effect may be the more
/// probable of both? What the two leave of each other no linear algebra tells: their curvature is more.
bool SetsSearch::relieves(const Effect* effect, const EffectSet& set) const {
  const VectorXd weight = set.evidence.variance.cwiseSqrt().cwiseInverse();
  const Index tolerances = set.model.u.size() - static_cast<Index>(rig::basic_nuisances);
  for (Index i = 0; i < tolerances; ++i) {
    if (std::pow(set.model.u.tail(tolerances)[i], 2) < least_promise) continue;
    const VectorXd strained = weight.cwiseProduct(set.columns.rightCols(tolerances).col(i)).normalized();
    for (const Response& response : responses_)
      if (response.term.effect == effect &&
          std::pow(strained.dot(weight.cwiseProduct(response.change).normalized()), 2) > 0.5)
        return true;
  }
  return false;
}

/// The log posterior of a set whose part without one of its effects was fitted exactly and explains more, by linear algebra there:
/// that effect at its best size, which is its prior's sd, too. None if it promises more than its prior odds cost.
std::optional<double> SetsSearch::posterior_beside_part(const EffectSet& set) const {
  const auto is_in = [](const Effect* effect, const EffectSet& of) {
    return std::ranges::count(of.model.terms, effect, &rig::ModelTerm::effect) > 0;
  };
  for (const EffectSet& part : sets_) {
    const bool lacks_one = added(part) + 1 == added(set) &&
                           std::ranges::all_of(part.model.terms, [&](const rig::ModelTerm& term) {
                             return is_in(term.effect, set);
                           });
    if (!part.exact || !lacks_one || part.log_posterior < set.log_posterior) continue;
    const Effect* other = std::ranges::find_if(set.model.terms, [&](const rig::ModelTerm& term) {
                            return !is_in(term.effect, part);
                          })->effect;
    // What moments do has no response.
    if (other->change_points() != ChangePoints::none || relieves(other, part)) continue;
    const Screening beside(responses_, part.target(), part.columns, part.evidence);
    double gain = 0.0;
    for (size_t i = 0; i < responses_.size(); ++i)
      if (responses_[i].term.effect == other) gain = std::max(gain, beside.best_single(i));
    const double odds =
        set.log_posterior - set.evidence.log_evidence - (part.log_posterior - part.evidence.log_evidence);
    if (gain < least_promise)
      return part.log_posterior + 0.5 * (gain * gain / (1.0 + gain) - std::log1p(gain)) + odds;
  }
  return {};
}

void SetsSearch::fit_best_again(size_t effects) {
  sort_sets();
  size_t count = 0;
  double best = 0.0;
  for (EffectSet& set : sets_) {
    if (added(set) != effects) continue;
    if (++count > retaken || (count > 1 && set.log_posterior < best - second_in_reach)) break;
    if (const auto posterior = posterior_beside_part(set)) {
      set.log_posterior = *posterior;
    } else {
      // Without effects tolerances may wander far after what they cannot make: then their linear fit stands.
      EffectSet again = fit_set_exactly(problem_, set);
      if (effects > 0 || inference::is_settled(again.termination)) set = std::move(again);
    }
    if (count == 1) best = set.log_posterior;
  }
  sort_sets();
}

/// May the rig without effects come near the best set of one, once its tolerances are not linear? At that set's tolerances, linear
/// algebra tells. Without effects a search goes a long way after what tolerances cannot make.
bool SetsSearch::is_plain_in_reach() const {
  const auto of_size = [&](size_t effects) {
    return std::ranges::find_if(sets_, [&](const EffectSet& set) { return added(set) == effects; });
  };
  const auto plain = of_size(0), best = of_size(1);
  if (plain == sets_.end() || best == sets_.end()) return true;
  const double least = best->log_posterior - second_in_reach;
  if (plain->log_posterior >= least) return true;
  SessionModel start = best->model;
  start.terms.resize(options_.terms.size());
  start.values.resize(options_.values.size());
  return fit_set(problem_, start, best->known, best->evidence.shares, least).log_posterior >= least;
}

SetSearch SetsSearch::run() {
  report("fitting the rig's model");
  base_ = declared_rig(problem_, {.terms = options_.terms, .values = options_.values, .u = {}});
  sets_.push_back(fit_set(problem_, base_.at, base_, problem_.error().prior.share));
  const EffectSet plain = sets_.front();
  report("computing what each effect would do");
  const rig::EvidenceFit stated =
      fit_linear(base_.target(problem_), base_.columns, problem_.error(), problem_.error().prior.share);
  responses_ = effect_responses(problem_, base_, stated.variance.cwiseSqrt());
  SetSearch found;
  found.given = options_.terms.size();
  const rig::EvidenceFit adapted =
      fit_linear(base_.target(problem_), base_.columns, problem_.error(), plain.evidence.shares);
  report("fitting the effects that promise most");
  for (const rig::EvidenceFit* under : {&stated, &adapted}) {
    const std::vector<Promise> singles = promises(*under, false);
    for (size_t i = 0; i < std::min(singles_fitted, singles.size()); ++i)
      if (is_worth_fitting(singles, i, least_promise)) fit(singles[i].responses);
    if (under == &stated)
      for (const Promise& promise : singles)
        found.promises.emplace_back(responses_[promise.responses.front()].term.effect->text().id,
                                    promise.gain);
  }
  for (const Effect* effect : problem_.session().effects.of_rig())
    if (effect->change_points() != ChangePoints::none)
      if (const auto start = scan_events(problem_, plain, *effect))
        fit(*start, base_, problem_.error().prior.share);
  report("fitting the best of them again");
  fit_best_again(1);
  if (is_plain_in_reach()) fit_best_again(0);
  report("fitting the pairs that promise most");
  for (const rig::EvidenceFit* under : {&stated, &adapted}) {
    const std::vector<Promise> singles = promises(*under, false);
    const std::vector<Promise> pairs = promises(*under, true);
    const double least =
        least_promise + std::max(least_promise, singles.empty() ? 0.0 : singles.front().gain);
    for (size_t i = 0; i < std::min(pairs_fitted / 2, pairs.size()); ++i)
      if (is_worth_fitting(pairs, i, least)) fit(pairs[i].responses);
  }
  fit_beside_best();
  fit_synergies();
  report("fitting the best pairs again");
  fit_best_again(2);
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

SetSearch search_sets(const rig::SessionProblem& problem, const SetSearchOptions& options) {
  return SetsSearch(problem, options).run();
}

}  // namespace diastole::explain
