#include "estimator/explain/rig/search.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>

#include "estimator/explain/rig/tolerance.hpp"
#include "estimator/explain/verdict/chi_square.hpp"
#include "estimator/explain/verdict/verdict.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole::explain {
namespace {

constexpr double far_behind = 4.0;      // of the best set's excess over the floor: not followed further
constexpr double at_the_floor = 0.003;  // of reduced chi-squares
constexpr double alike =
    0.8;  // of a member's drop in chi-square: what a look-alike's linear gain reaches at least
constexpr double alike_by_scan = 0.9;  // the same for scanned change points, whose gain is known within 5 %
constexpr double hopeless = 0.3;  // of the best lead's gain: linear gains of large effects are approximate

constexpr double models_error = 5e-5;  // of explained squares: the model errs by 0.7 % of what effects change
constexpr double worth_a_partner = 0.02;  // of reduced chi-square above the noise, for a synergy to be tried

bool names(const std::vector<std::string_view>& ids, const Effect& effect) {
  return std::find(ids.begin(), ids.end(), effect.text().id) != ids.end();
}

bool are_partners(const Effect& a, const Effect& b) {
  return names(a.text().synergies, b) || names(b.text().synergies, a);
}

std::vector<std::string> ids_of(const std::vector<rig::ModelTerm>& terms) {
  std::vector<std::string> ids;
  for (const rig::ModelTerm& term : terms)
    ids.emplace_back(term.effect->text().id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

bool has_change_points(const Lead& lead) { return lead.term.effect->change_points() != ChangePoints::none; }

/// The sets with one member less.
std::vector<std::vector<rig::ModelTerm>> each_left_out(const std::vector<rig::ModelTerm>& set) {
  std::vector<std::vector<rig::ModelTerm>> sets(set.size(), set);
  for (size_t member = 0; member < set.size(); ++member)
    sets[member].erase(sets[member].begin() + static_cast<std::ptrdiff_t>(member));
  return sets;
}

class Search {
 public:
  Search(const rig::Session& session, const rig::SpecimenFamily& family, const rig::RigProblem& problem,
         const SearchOptions& options)
      : session_(session),
        family_(family),
        problem_(problem),
        options_(options),
        weights_(row_weights(session, problem, options.change)) {
    add(problem.base());
  }
  SearchResult run();

 private:
  size_t add(rig::RigFit fit) {
    FittedSet set{std::move(fit), 0.0};
    set.chi_square = set.fit.residuals.cwiseAbs2().dot(weights_);
    if (!std::isfinite(set.chi_square)) set.chi_square = std::numeric_limits<double>::infinity();
    result_.sets.push_back(std::move(set));
    return result_.sets.size() - 1;
  }
  /// The sets' places; those that were not fitted before are fitted now, several at a time.
  std::vector<size_t> fitted(const std::vector<std::vector<rig::ModelTerm>>& sets, const rig::RigFit& before);
  size_t fitted(const std::vector<rig::ModelTerm>& set, const rig::RigFit& before) {
    return fitted(std::vector<std::vector<rig::ModelTerm>>{set}, before).front();
  }
  [[nodiscard]] std::optional<size_t> place_of(const std::vector<std::string>& ids) const;
  /// chi-square with what its parameters cost, and what each further effect might only take from the model's error of
  /// the others.
  [[nodiscard]] double penalised(size_t set) const {
    const FittedSet& at = result_.sets[set];
    if (at.fit.terms.empty()) return at.chi_square;
    const double explained = std::max(result_.sets.front().chi_square - at.chi_square, 0.0);
    const auto further = static_cast<double>(at.fit.terms.size() - 1);
    return at.chi_square + cost(at) + further * models_error * explained;
  }
  [[nodiscard]] double reduced(size_t set) const { return result_.sets[set].chi_square / weights_.sum(); }
  [[nodiscard]] static double cost(const FittedSet& set) {
    double sum = 0.0;
    for (const rig::ModelTerm& term : set.fit.terms)
      sum +=
          admission(term.effect->parameters().size() + change_point_parameters * term.change_points.size());
    return sum;
  }
  /// Screening of the residuals of a set; done once.
  std::vector<Lead>& leads_beside(size_t set);
  struct Attempt {
    Lead* lead;
    double least_gain;
  };
  /// The sets with each lead added, but for those whose change points are searched and gain too little.
  std::vector<size_t> tried(size_t from, const std::vector<Attempt>& attempts);
  [[nodiscard]] bool worth_searching(size_t from, const Lead& lead, const std::vector<size_t>& grown) const;
  std::vector<size_t> grow(size_t from);
  std::vector<size_t> with_rivals(size_t from, const std::vector<size_t>& grown);
  std::vector<size_t> with_partners(size_t from, const std::vector<size_t>& grown);
  void begin_with(const std::vector<rig::ModelTerm>& start);
  /// Whether a set may get a third effect: not if two left most of the misfit.
  [[nodiscard]] bool may_grow(size_t set) const {
    constexpr double most = 0.5;
    return result_.sets[set].fit.terms.size() < 2 ||
           result_.sets[set].chi_square < most * result_.sets.front().chi_square;
  }
  void seek();
  void compare_alike(size_t set);
  /// Whether an effect without change points is not in the set yet and fits the specimen.
  [[nodiscard]] bool can_join(const std::vector<rig::ModelTerm>& set, const Effect& effect) const {
    return effect.change_points() == ChangePoints::none && effect.fits(family_) &&
           std::none_of(set.begin(), set.end(), [&](const auto& in) { return in.effect == &effect; });
  }
  /// One thread at a time; may throw.
  void tell(const std::string& text) {
    const std::scoped_lock lock(telling_);
    if (options_.progress) options_.progress(text);
  }

  const rig::Session& session_;
  const rig::SpecimenFamily& family_;
  const rig::RigProblem& problem_;
  const SearchOptions& options_;
  Eigen::VectorXd weights_;
  SearchResult result_;
  std::map<size_t, std::vector<Lead>> leads_;
  std::mutex telling_;
};

std::optional<size_t> Search::place_of(const std::vector<std::string>& ids) const {
  for (size_t k = 0; k < result_.sets.size(); ++k)
    if (result_.sets[k].ids() == ids) return k;
  return {};
}

std::vector<size_t> Search::fitted(const std::vector<std::vector<rig::ModelTerm>>& sets,
                                   const rig::RigFit& before) {
  std::vector<std::optional<rig::RigFit>> fits(sets.size());
  parallel_for(sets.size(), problem_.threads(), [&](size_t i) {
    const std::vector<std::string> ids = ids_of(sets[i]);
    if (place_of(ids)) return;
    tell(fmt::format("fitting {}", fmt::join(ids, " + ")));
    fits[i] = problem_.fit(sets[i], before);
  });
  std::vector<size_t> places;
  for (size_t i = 0; i < sets.size(); ++i) {
    const auto place = place_of(ids_of(sets[i]));
    places.push_back(place ? *place : add(std::move(*fits[i])));
  }
  return places;
}

std::vector<Lead>& Search::leads_beside(size_t set) {
  const auto known = leads_.find(set);
  if (known != leads_.end()) return known->second;
  const rig::RigFit& current = result_.sets[set].fit;
  tell(current.terms.empty() ? "screening the effects"
                             : fmt::format("screening beside {}", fmt::join(ids_of(current.terms), " + ")));
  std::vector<Lead> leads = screen(problem_, family_, session_, current, weights_, [this] { tell(""); });
  return leads_.emplace(set, std::move(leads)).first->second;
}

std::vector<size_t> Search::tried(size_t from, const std::vector<Attempt>& attempts) {
  const rig::RigFit current = result_.sets[from].fit;
  parallel_for(attempts.size(), problem_.threads(), [&](size_t i) {
    Lead& lead = *attempts[i].lead;
    if (!has_change_points(lead)) return;
    tell(fmt::format("searching change points of {}", lead.term.effect->text().id));
    search_change_points(lead, problem_, session_, current, weights_);
  });
  std::vector<size_t> places;
  std::vector<std::vector<rig::ModelTerm>> sets;
  for (const Attempt& attempt : attempts) {
    const Lead& lead = *attempt.lead;
    if (lead.gain < attempt.least_gain) continue;
    std::vector<rig::ModelTerm> set = current.terms;
    set.push_back(lead.term);
    if (!lead.fit) {
      sets.push_back(std::move(set));
    } else {
      const auto place = place_of(ids_of(set));
      places.push_back(place ? *place : add(*lead.fit));
    }
  }
  for (const size_t place : fitted(sets, current))
    places.push_back(place);
  return places;
}

/// Where the best of the grown sets leaves misfit, what its effect is mistaken for in its place, whatever the screening says of it.
std::vector<size_t> Search::with_rivals(size_t from, const std::vector<size_t>& grown) {
  if (grown.empty()) return {};
  const size_t best = *std::min_element(grown.begin(), grown.end(),
                                        [this](size_t a, size_t b) { return penalised(a) < penalised(b); });
  if (reduced(best) < 1.0 + worth_a_partner) return {};
  const rig::RigFit current = result_.sets[from].fit;
  const Effect& mistaken = *result_.sets[best].fit.terms.back().effect;
  std::vector<std::vector<rig::ModelTerm>> swapped;
  for (const Effect* rival : all_effects()) {
    if (!names(mistaken.text().conflicts, *rival) || !can_join(current.terms, *rival)) continue;
    swapped.push_back(current.terms);
    swapped.back().push_back({rival, {}});
  }
  std::vector<size_t> rivals = fitted(swapped, current);
  std::erase_if(rivals,
                [&](size_t set) { return std::find(grown.begin(), grown.end(), set) != grown.end(); });
  return rivals;
}

/// Sets grown by one effect, grown by its synergies as well: together they do what neither begins alone.
std::vector<size_t> Search::with_partners(size_t from, const std::vector<size_t>& grown) {
  std::vector<size_t> pairs;
  for (const size_t set : grown) {
    const rig::RigFit one = result_.sets[set].fit;
    if (reduced(set) < 1.0 + worth_a_partner || !may_grow(set) ||
        one.terms.size() >= options_.start.size() + options_.most_effects)
      continue;
    std::vector<std::vector<rig::ModelTerm>> together;
    for (const Effect* partner : all_effects()) {
      if (!are_partners(*one.terms.back().effect, *partner) || !can_join(one.terms, *partner)) continue;
      together.push_back(one.terms);
      together.back().push_back({partner, {}});
    }
    for (const size_t pair : fitted(together, one))
      if (penalised(pair) < penalised(from)) pairs.push_back(pair);
  }
  return pairs;
}

/// Whether a lead's change points are worth their search, which costs more than all other fits: not if what a scan promises is
/// far behind what was fitted already.
bool Search::worth_searching(size_t from, const Lead& lead, const std::vector<size_t>& grown) const {
  constexpr double inexact = 1.1;  // of the promise
  const double promised = std::max(result_.sets[from].chi_square - inexact * lead.gain, 0.0) / weights_.sum();
  return std::all_of(grown.begin(), grown.end(),
                     [&](size_t set) { return worth_following(promised, reduced(set)); });
}

/// The sets with one effect more that a screening finds worth a fit.
std::vector<size_t> Search::grow(size_t from) {
  std::vector<Lead>& leads = leads_beside(from);
  std::vector<size_t> grown;
  const auto try_all = [&](const std::vector<Attempt>& attempts) {
    for (const size_t set : tried(from, attempts))
      grown.push_back(set);
  };
  const double hope = leads.empty() ? 0.0 : hopeless * leads.front().gain;
  for (size_t next = 0; grown.size() < options_.refitted && next < leads.size();) {
    std::vector<Attempt> sized,
        with_change_points;  // more follow where searched change points come to nothing
    for (; grown.size() + sized.size() + with_change_points.size() < options_.refitted && next < leads.size();
         ++next) {
      const double least = admission(leads[next].parameters);
      if (leads[next].gain >= std::max(hope, least))
        (has_change_points(leads[next]) ? with_change_points : sized).push_back({&leads[next], least});
    }
    try_all(sized);
    std::erase_if(with_change_points,
                  [&](const Attempt& attempt) { return !worth_searching(from, *attempt.lead, grown); });
    try_all(with_change_points);
  }
  for (const size_t rival : with_rivals(from, grown))
    grown.push_back(rival);
  for (const size_t pair : with_partners(from, grown))
    grown.push_back(pair);
  std::sort(grown.begin(), grown.end(), [this](size_t a, size_t b) { return penalised(a) < penalised(b); });
  return grown;
}

/// Each member of the set replaced by what looks like it, unless the screening without that member already says that
/// it takes off much less.
void Search::compare_alike(size_t set) {
  const std::vector<rig::ModelTerm> chosen = result_.sets[set].fit.terms;
  for (const size_t without : fitted(each_left_out(chosen), problem_.base())) {
    const double drop = result_.sets[without].chi_square - result_.sets[set].chi_square;
    std::vector<Attempt> attempts;
    for (Lead& lead : leads_beside(without)) {
      const Effect* other = lead.term.effect;
      const bool contained = std::any_of(chosen.begin(), chosen.end(),
                                         [&](const rig::ModelTerm& in) { return in.effect == other; });
      const double near = has_change_points(lead) ? alike_by_scan : alike;
      const double least = std::max(near * drop, admission(lead.parameters)) - as_good;
      if (!contained && lead.gain >= least) attempts.push_back({&lead, least});
    }
    tried(without, attempts);
  }
}

SearchResult Search::run() {
  seek();
  result_.leads = leads_beside(0);
  std::sort(result_.leads.begin(), result_.leads.end(),
            [](const Lead& a, const Lead& b) { return a.gain > b.gain; });
  return std::move(result_);
}

/// The set, or what is better without a member that another noise has made superfluous.
void Search::begin_with(const std::vector<rig::ModelTerm>& start) {
  result_.best = fitted(start, problem_.base());
  if (start.size() == 1) return;
  for (const size_t without : fitted(each_left_out(start), problem_.base()))
    if (penalised(without) < penalised(result_.best)) result_.best = without;
}

void Search::seek() {
  if (!options_.start.empty()) begin_with(options_.start);
  std::vector<size_t> beam{result_.best};
  for (size_t effects = 0; effects < options_.most_effects; ++effects) {
    std::vector<size_t> grown;
    for (const size_t from : beam) {
      if (!may_grow(from)) continue;
      for (const size_t set : grow(from))
        if (penalised(set) < penalised(from)) grown.push_back(set);
    }
    std::sort(grown.begin(), grown.end(), [this](size_t a, size_t b) { return penalised(a) < penalised(b); });
    grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
    if (grown.empty() || penalised(grown.front()) >= penalised(result_.best)) break;
    result_.best = grown.front();
    if (reduced(result_.best) < options_.enough * reduced(0)) return;
    grown.resize(std::min(grown.size(), options_.beam));
    std::erase_if(grown, [&](size_t set) { return !worth_following(reduced(set), reduced(result_.best)); });
    beam = grown;
  }
  if (leaves_misfit(result_.sets.front(), result_.sets[result_.best])) return;
  for (size_t compared = result_.sets.size(); compared != result_.best;) {
    compared = result_.best;
    compare_alike(compared);
    for (size_t k = 0; k < result_.sets.size(); ++k)
      if (penalised(k) < penalised(result_.best)) result_.best = k;
  }
}

}  // namespace

bool worth_following(double reduced, double best) {
  const double left =
      std::max(best - 1.0, 0.0);  // the noise is estimated: the best may have less than none left
  return reduced - std::min(best, 1.0) <= far_behind * left + at_the_floor;
}

bool leaves_misfit(const FittedSet& base, const FittedSet& best) {
  constexpr double plainly = 1.5;  // of reduced chi-squares
  constexpr double hardly = 0.1;   // of the base model's: the best is right as far as it goes
  return best.fit.reduced() > plainly && best.chi_square > hardly * base.chi_square;
}

std::vector<std::string> FittedSet::ids() const { return ids_of(fit.terms); }

size_t FittedSet::parameters() const {
  size_t count = 0;
  for (const rig::ModelTerm& term : fit.terms)
    count += term.effect->parameters().size();
  return count;
}

double admission(size_t parameters) { return chi_square_exceeded(1e-7, static_cast<double>(parameters)); }

Eigen::VectorXd row_weights(const rig::Session& session, const rig::RigProblem& problem,
                            const Eigen::VectorXd& change) {
  Eigen::VectorXd variance = model_variance(problem, change);
  for (const rig::ResidualBlock& block : problem.blocks()) {
    if (block.channel == "cavity_mL") continue;
    const rig::SessionRun& run = session.runs[block.run];
    const auto cycles = static_cast<double>(run.drive.place.trigger_s.size());
    const auto segments = static_cast<double>(std::max<size_t>(run.segments.size(), 1));
    variance.segment(static_cast<Eigen::Index>(block.first), static_cast<Eigen::Index>(block.count)) *=
        std::max(cycles / segments, 1.0);
  }
  return (1.0 + variance.array()).inverse();
}

SearchResult search(const rig::Session& session, const rig::SpecimenFamily& family,
                    const rig::RigProblem& problem, const SearchOptions& options) {
  return Search(session, family, problem, options).run();
}

}  // namespace diastole::explain
