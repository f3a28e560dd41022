#include "estimator/explain/rig/set_verdict.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "estimator/explain/rig/changed_parts.hpp"
#include "estimator/explain/rig/equation_errors.hpp"
#include "estimator/explain/rig/held_out.hpp"
#include "estimator/explain/rig/part_strain.hpp"
#include "estimator/inference/tail_probability.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Ids = std::vector<std::string>;

constexpr double name_probability = 0.9;
const double sure_odds = std::log(name_probability / (1.0 - name_probability));
constexpr double least_probability = 0.05;     ///< of a set that is reported
constexpr double irregular_by_chance = 0.001;  ///< that equal cycles differ by more than noise makes them

struct Sizes {
  std::vector<double> over_error;
  std::vector<bool> material;
  VectorXd changed;  ///< squares of what all of them change
};

/// Squares of features by signal, over the samples they live in.
std::array<double, rig::signal_count> mean_squares(const rig::SessionProblem& problem,
                                                   const VectorXd& squares) {
  std::array<double, rig::signal_count> sums{}, rows{};
  for (const rig::FeatureBlock& block : problem.features().blocks()) {
    const auto s = static_cast<size_t>(block.signal);
    sums[s] +=
        squares.segment(static_cast<Index>(block.first), static_cast<Index>(block.features.size())).sum();
    rows[s] += static_cast<double>(block.rows);
  }
  for (size_t s = 0; s < sums.size(); ++s)
    sums[s] = rows[s] > 0.0 ? sums[s] / rows[s] : 0.0;
  return sums;
}

VectorXd error_squares(const rig::ModelError& error, const rig::Shares& shares) {
  return error.variance(shares) - error.noise;
}

/// Do parts of the declared rig that are less than a surprise off, in all, make the same change? What modulus and offsets make
/// of it, all but `beyond` of them, carries no information.
bool is_tolerance(const rig::SessionProblem& problem, const EffectSet& set, const VectorXd& change,
                  const VectorXd& beyond) {
  const rig::TolerancePrior& prior = problem.prior(set.model);
  const Eigen::MatrixXd& root = prior.root;
  Eigen::MatrixXd columns = set.known.columns;  // by u: now by basic nuisances and by the parts' sds
  columns.rightCols(root.cols()) =
      root.transpose().partialPivLu().solve(columns.rightCols(root.cols()).transpose()).transpose() *
      prior.described.asDiagonal();
  const VectorXd weight = set.evidence.variance.cwiseInverse();
  Eigen::MatrixXd normal = columns.transpose() * weight.asDiagonal() * columns;
  constexpr double nearly_free = 1e-6;
  normal.diagonal().head(rig::basic_nuisances).array() += nearly_free;
  normal.diagonal().tail(root.cols()).array() += 1.0;
  const VectorXd parts = normal.llt().solve(columns.transpose() * weight.cwiseProduct(change));
  const VectorXd left = change - columns * parts;
  return parts.tail(root.cols()).norm() < surprising_sds &&
         left.cwiseAbs2().dot(weight) < right_to * right_to * beyond.cwiseAbs2().dot(weight);
}

}  // namespace

ChangeSize size_of_change(const rig::SessionProblem& problem, const EffectSet& set, const VectorXd& change) {
  const Eigen::MatrixXd basic = set.known.columns.leftCols(rig::basic_nuisances);
  const VectorXd weight = set.evidence.variance.cwiseInverse();
  Eigen::MatrixXd normal = basic.transpose() * weight.asDiagonal() * basic;
  normal.diagonal().array() += 1e-6;  // a channel that is not there has no offset
  const VectorXd left = change - basic * normal.llt().solve(basic.transpose() * weight.cwiseProduct(change));
  const auto error = mean_squares(problem, error_squares(problem.error(), set.evidence.shares));
  const auto size = mean_squares(problem, left.cwiseAbs2());
  ChangeSize found{.squares = left.cwiseAbs2(),
                   .over_error = 0.0,
                   .is_tolerance = is_tolerance(problem, set, change, left)};
  for (size_t s = 0; s < size.size(); ++s)
    if (error[s] > 0.0) found.over_error = std::max(found.over_error, std::sqrt(size[s] / error[s]));
  return found;
}

namespace {

/// What each of a set's effects changes of the features, a column each.
Eigen::MatrixXd changes_of(const rig::SessionProblem& problem, const EffectSet& set) {
  std::vector<rig::SessionModel> models{set.model};
  size_t at = 0;
  for (size_t leave = 0; leave < set.model.terms.size(); ++leave) {
    rig::SessionModel without = set.model;
    const size_t count = set.model.terms[leave].effect->parameters().size();
    const auto first = without.values.begin() + static_cast<std::ptrdiff_t>(at);
    without.values.erase(first, first + static_cast<std::ptrdiff_t>(count));
    without.terms.erase(without.terms.begin() + static_cast<std::ptrdiff_t>(leave));
    models.push_back(std::move(without));
    at += count;
  }
  const Eigen::MatrixXd shown = problem.predicted_features(models);
  return -(shown.rightCols(shown.cols() - 1).colwise() - shown.col(0));
}

/// Is an effect that is small beside the others of its set more than an error of their equations? The set's odds against the one without
/// it hold beside such errors.
bool outlasts_equation_errors(const rig::SessionProblem& problem, const EffectSet& set,
                              const Eigen::MatrixXd& changes, size_t effect, const WeighedSets& search) {
  Ids others;
  for (size_t i = 0; i < set.model.terms.size(); ++i)
    if (i != effect) others.emplace_back(set.model.terms[i].effect->text().id);
  std::ranges::sort(others);
  const EffectSet* rival = nullptr;
  for (const EffectSet& without : search.sets)
    if (without.ids() == others && inference::is_settled(without.termination) &&
        (rival == nullptr || without.log_posterior > rival->log_posterior))
      rival = &without;
  return rival != nullptr &&
         log_odds_beside_equation_errors(problem, set, *rival, changes, effect) > sure_odds;
}

/// What a set's effects change each, over the model's error.
Sizes sizes_of(const rig::SessionProblem& problem, const EffectSet& set, const ErrorKnowledge& known,
               const WeighedSets& search) {
  Sizes sizes;
  if (set.model.terms.empty()) return sizes;
  const Eigen::MatrixXd changes = changes_of(problem, set);
  sizes.changed = VectorXd::Zero(changes.rows());
  for (Index i = 0; i < changes.cols(); ++i) {
    const ChangeSize size = size_of_change(problem, set, changes.col(i));
    sizes.changed += size.squares;
    sizes.over_error.push_back(size.over_error);
    sizes.material.push_back(static_cast<size_t>(i) < search.given ||
                             (size.over_error >= known.least_size() && !size.is_tolerance));
  }
  const double largest = *std::ranges::max_element(sizes.over_error);
  for (size_t i = search.given; i < sizes.material.size(); ++i)
    sizes.material[i] = sizes.material[i] && (sizes.over_error[i] >= right_to * largest ||
                                              outlasts_equation_errors(problem, set, changes, i, search));
  return sizes;
}

Ids material_ids(const EffectSet& set, const Sizes& sizes) {
  Ids ids;
  for (size_t i = 0; i < set.model.terms.size(); ++i)
    if (sizes.material[i]) ids.emplace_back(set.model.terms[i].effect->text().id);
  std::ranges::sort(ids);
  return ids;
}

/// Of the model's error in this session.
size_t parts_of(const rig::ModelError& error) {
  std::array<bool, rig::error_groups> present{};
  for (const rig::ErrorGroup group : error.group)
    present[static_cast<size_t>(group)] = true;
  return static_cast<size_t>(std::ranges::count(present, true));
}

/// A tone in the recordings that is louder than all other noise, as much larger than the model's error as an effect has to be, and than what
/// instruments are right to. Quieter hum is noise, which every sensor has.
std::optional<rig::Tone> material_tone(const rig::SessionProblem& problem, const EffectSet& set,
                                       const ErrorKnowledge& error) {
  const std::optional<rig::Tone> tone = rig::find_tone(problem.session());
  const double least_kPa = std::max(
      error.least_size() * error_rms(problem, set.evidence.shares, rig::Signal::cavity),
      rig::SharePrior::least[static_cast<size_t>(rig::ErrorGroup::cavity)] * problem.error().range[0]);
  return tone && tone->rms_kPa > std::max(least_kPa, tone->noise_kPa) ? tone : std::nullopt;
}

/// How often noise alone makes equal cycles differ so; 1 where they do not differ materially.
double irregularity_by_chance(const rig::SessionProblem& problem,
                              const std::vector<rig::CycleScatter>& scatter) {
  double least = 1.0;
  for (const rig::CycleScatter& channel : scatter) {
    const auto group = channel.signal == rig::Signal::pump ? rig::ErrorGroup::pump : rig::ErrorGroup::cavity;
    const double least_kPa = rig::SharePrior::least[static_cast<size_t>(group)] *
                             problem.error().range[static_cast<size_t>(channel.signal)];
    if (channel.rms_kPa > least_kPa) least = std::min(least, inference::normal_tail(channel.sds));
  }
  return least;
}

/// How often the parts of the rig are in all as far from what is declared or was learnt of them. Those that are known to
/// an order of magnitude only, by no data sheet, may be anywhere; and so may those that an effect changes.
double strain_in_all_by_chance(const rig::SessionProblem& problem, const EffectSet& set, const VectorXd& u) {
  const Index count = u.size() - static_cast<Index>(rig::basic_nuisances);
  std::vector<Index> known;
  for (Index i = 0; i < count; ++i) {
    const rig::Nuisance& part = problem.nuisances()[static_cast<size_t>(i) + rig::basic_nuisances];
    if (!part.is_guess() && !is_changed(set.model, part.name)) known.push_back(i);
  }
  const rig::TolerancePrior& prior = problem.prior(set.model);
  const VectorXd moved = prior.root * u.tail(count);
  const Eigen::MatrixXd root = prior.described.cwiseInverse().asDiagonal() * prior.root;
  const Eigen::MatrixXd covariance = (root * root.transpose())(known, known);
  const VectorXd of_known = moved(known);
  const double square = of_known.dot(covariance.llt().solve(of_known));
  return inference::chi_square_tail(square, static_cast<double>(known.size()));
}

struct NameByChance {
  double probability;
  inference::Termination termination;  ///< of the fit
};

/// How often, by chance, the parts of the error are as large beneath this name, or the rig's as far off in all: what its effects
/// change may be wrong to the part that equations of real parts are.
NameByChance name_by_chance(const rig::SessionProblem& problem, const EffectSet& set, const Sizes& sizes) {
  rig::ModelError error = problem.error();
  error.noise += right_to * right_to * sizes.changed;
  const rig::EvidenceFit again = fit_with_shares(set.target(), set.columns, error, set.evidence.shares);
  const auto parts = static_cast<double>(parts_of(error));
  return {std::min(parts * inference::normal_tail(std::ranges::max(again.surprise(error.prior))),
                   strain_in_all_by_chance(problem, set, again.estimate.tail(set.model.nuisances.size()))),
          again.termination};
}

/// ln of the odds of a set on waveforms that it was not fitted to alone: what it gains there has to overcome the effects' prior
/// odds as all data do.
double held_out_odds(double log_factor, size_t effects) {
  return log_factor + static_cast<double>(effects) * std::log(effect_odds);
}

/// How often, by chance, where nothing is wrong, one part of the error is as large, one tolerance as far to either side, or both
/// are as seldom together (Fisher 1925: minus two ln of their product is chi-square on four). 0 of a search that did not settle.
double nothing_wrong_by_chance(const rig::SessionProblem& problem, const EffectSet& set) {
  if (!inference::is_settled(set.termination)) return 0.0;
  const double misfit =
      inference::normal_tail(std::ranges::max(set.evidence.surprise(problem.error().prior)));
  const double strain = strain_by_chance(problem, set.model, set.model.nuisances);
  const double product = misfit * strain;
  const double together = product > 0.0 ? product * (1.0 - std::log(product)) : 0.0;
  return std::min({misfit, strain, together});
}

/// That a model is wrong of which what is seen is so seldom by chance, at even odds before: the most that a p-value can mean
/// (Sellke, Bayarri and Berger 2001).
double probability_wrong(double by_chance) {
  if (by_chance <= 0.0) return 1.0;
  constexpr double says_nothing = 1.0 / std::numbers::e;
  return by_chance < says_nothing ? 1.0 / (1.0 - std::numbers::e * by_chance * std::log(by_chance)) : 0.5;
}

}  // namespace

double error_rms(const rig::SessionProblem& problem, const rig::Shares& shares, rig::Signal signal) {
  return std::sqrt(
      mean_squares(problem, error_squares(problem.error(), shares))[static_cast<size_t>(signal)]);
}

namespace {

constexpr double considered = 0.01;  ///< of a probability: less decides nothing beside nine tenths

/// Sets that differ by hints alone say the same: their probabilities add.
struct Group {
  double probability = 0.0;
  size_t best = 0;
};

struct GroupedSets {
  std::map<Ids, Group> groups;  ///< by their material effects
  std::vector<Sizes> sizes;     ///< of each set that is considered
  std::vector<Hint> hints;      ///< of even odds and more
  [[nodiscard]] const std::pair<const Ids, Group>& leading() const {
    return *std::ranges::max_element(groups, {}, [](const auto& group) { return group.second.probability; });
  }
};

GroupedSets grouped_by_material(const rig::SessionProblem& problem, const WeighedSets& search,
                                const ErrorKnowledge& error) {
  GroupedSets grouped;
  grouped.sizes.resize(search.sets.size());
  for (size_t k = 0; k < search.sets.size(); ++k) {
    if (search.probability[k] < considered) continue;
    Sizes& sizes = grouped.sizes[k];
    sizes = sizes_of(problem, search.sets[k], error, search);
    const Ids ids = material_ids(search.sets[k], sizes);
    grouped.groups.try_emplace(ids, Group{0.0, k}).first->second.probability += search.probability[k];
    for (size_t i = 0; i < sizes.material.size(); ++i) {
      if (sizes.material[i]) continue;
      const std::string id(search.sets[k].model.terms[i].effect->text().id);
      auto hint = std::ranges::find(grouped.hints, id, &Hint::id);
      if (hint == grouped.hints.end()) hint = grouped.hints.insert(hint, Hint{id, sizes.over_error[i], 0.0});
      hint->probability += search.probability[k];
    }
  }
  std::erase_if(grouped.hints, [](const Hint& hint) { return hint.probability < 0.5; });
  return grouped;
}

/// The leading group's best set; that of its own effects alone, if the one with a hint beside them did not settle: a name rests on a
/// search that did.
size_t standing_for(const std::pair<const Ids, Group>& leading, const WeighedSets& search) {
  if (inference::is_settled(search.sets[leading.second.best].termination)) return leading.second.best;
  const auto own = std::ranges::find_if(search.sets, [&](const EffectSet& set) {
    return set.ids() == leading.first && inference::is_settled(set.termination);
  });
  return own == search.sets.end() ? leading.second.best : static_cast<size_t>(own - search.sets.begin());
}

/// An effect is held against the same rig without it: parts that are as fine, or as coarse.
size_t without_effects(const rig::SessionProblem& problem, const WeighedSets& search, const EffectSet& best) {
  const auto is_plain = [&](const EffectSet& set) { return set.model.terms.size() == search.given; };
  const auto described = [&](const EffectSet& set) { return problem.prior(set.model).described; };
  auto plain = std::ranges::find_if(
      search.sets, [&](const EffectSet& set) { return is_plain(set) && described(set) == described(best); });
  if (plain == search.sets.end()) plain = std::ranges::find_if(search.sets, is_plain);
  return static_cast<size_t>(plain - search.sets.begin());
}

/// Is the search of another set that is likely enough to be reported not at its end? It would have become likelier.
bool has_open_rival(const GroupedSets& grouped, const WeighedSets& search) {
  const Ids& leading = grouped.leading().first;
  return std::ranges::any_of(grouped.groups, [&](const auto& other) {
    return other.first != leading && other.second.probability >= least_probability &&
           !inference::is_settled(search.sets[other.second.best].termination);
  });
}

/// Those that are likely enough beside a leading one that is not likely enough.
void list_rivals(SetVerdict& out, const GroupedSets& grouped, const WeighedSets& search) {
  const Ids& leading = grouped.leading().first;
  out.confidence = 0.0;
  for (const auto& [ids, group] : grouped.groups) {
    if (group.probability < least_probability) continue;
    out.confidence += group.probability;
    if (ids == leading) continue;
    out.ambiguous_with.push_back(ids);
    const EffectSet& other = search.sets[group.best];
    if (!other.model.terms.empty()) out.searches.push_back({other.ids(), other.termination});
  }
}

/// name_by_chance's probability; the verdict gets what the set gains on waveforms that it was not fitted to, and how all of its fits ended.
double weigh_name(const rig::SessionProblem& problem, const EffectSet& plain, const EffectSet& best,
                  const Sizes& sizes, SetVerdict& out) {
  const NameByChance chance = name_by_chance(problem, best, sizes);
  const HeldOutGain gain = held_out_gain(problem, plain, best);
  out.log_pseudo_bayes_factor = gain.log_pseudo_bayes_factor;
  const inference::Termination beside = inference::of_both(chance.termination, gain.termination);
  out.searches.push_back({best.ids(), inference::of_both(best.termination, beside)});
  return chance.probability;
}

}  // namespace

SetVerdict judge_sets(const rig::SessionProblem& problem, const WeighedSets& search,
                      const ErrorKnowledge& error) {
  GroupedSets grouped = grouped_by_material(problem, search, error);
  const auto& [ids, group] = grouped.leading();
  SetVerdict out;
  out.hints = std::move(grouped.hints);
  out.confidence = group.probability;
  out.chosen = standing_for(grouped.leading(), search);
  const EffectSet& best = search.sets[out.chosen];
  out.plain = without_effects(problem, search, best);
  const EffectSet& plain = search.sets[out.plain];
  const Sizes sizes =
      out.chosen == group.best ? grouped.sizes[group.best] : sizes_of(problem, best, error, search);
  out.size_over_error = sizes.over_error;
  out.material = sizes.material;
  out.searches.push_back({{}, plain.termination});
  if (!inference::is_settled(error.reference_termination))
    out.searches.push_back({{}, error.reference_termination, true});
  // Hints alone need no search that settled: nothing is named by it.
  const bool is_more = ids.size() > search.given;
  // That nothing is wrong holds with the hints or, unless the data exclude it, without them.
  const bool may_be_plain = search.probability[out.plain] >= considered;
  const double by_chance = is_more ? weigh_name(problem, plain, best, sizes, out)
                                   : std::max(nothing_wrong_by_chance(problem, best),
                                              may_be_plain ? nothing_wrong_by_chance(problem, plain) : 0.0);
  out.scatter = rig::cycle_scatter(problem, best.model);
  out.tone = material_tone(problem, best, error);
  const double irregular = irregularity_by_chance(problem, out.scatter);
  const bool settled = is_settled(out.searches);
  const bool is_irregular = irregular < irregular_by_chance;
  if (by_chance <= surprising_by_chance || is_irregular || !settled) {
    out.verdict = Verdict::unexplained;
    out.confidence =
        settled ? probability_wrong(is_irregular ? std::min(by_chance, irregular) : by_chance) : 0.5;
    return out;
  }
  if (out.confidence < name_probability || has_open_rival(grouped, search)) {
    out.verdict = Verdict::ambiguous;
    list_rivals(out, grouped, search);
    return out;
  }
  const double odds =
      is_more ? held_out_odds(*out.log_pseudo_bayes_factor, best.model.terms.size() - search.given)
              : sure_odds;
  const bool predicted = !is_more || odds > sure_odds;
  const bool may_be_nothing_known =
      odds > -sure_odds || nothing_wrong_by_chance(problem, plain) > surprising_by_chance;
  if (!predicted && !out.tone && may_be_nothing_known) {
    out.verdict = Verdict::ambiguous;
    for (size_t k = 0; k < search.sets.size(); ++k)
      if (search.sets[k].model.terms.size() == search.given) out.confidence += search.probability[k];
    out.ambiguous_with.push_back(plain.ids());
    return out;
  }
  out.is_tone_alone = !is_more && out.tone;
  const bool is_clean = !is_more && !out.tone;
  out.verdict = is_clean ? Verdict::none : is_more && predicted ? Verdict::named : Verdict::unexplained;
  if (out.verdict == Verdict::unexplained)
    out.confidence = std::max(predicted ? 0.0 : 1.0 / (1.0 + std::exp(odds)),
                              out.tone ? probability_wrong(out.tone->p_value) : 0.0);
  return out;
}

}  // namespace diastole::explain
