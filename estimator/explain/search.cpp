#include "estimator/explain/search.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "estimator/explain/chi_square.hpp"
#include "estimator/explain/tolerance.hpp"

namespace diastole::explain {
namespace {

std::vector<std::string> ids_of(const std::vector<rig::Ingredient>& ingredients) {
  std::vector<std::string> ids;
  for (const rig::Ingredient& ingredient : ingredients)
    ids.emplace_back(ingredient.effect->text().id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

class Search {
 public:
  Search(const rig::Session& session, const rig::SpecimenFamily& family, const rig::RigProblem& problem,
         const SearchOptions& options)
      : session_(session),
        family_(family),
        problem_(problem),
        options_(options),
        weights_(row_weights(session, problem)) {
    add(problem.base());
  }
  SearchResult run();

 private:
  size_t add(rig::RigFit fit) {
    FittedSet set{std::move(fit), 0.0};
    set.chi_square = set.fit.residuals.cwiseAbs2().dot(weights_);
    result_.sets.push_back(std::move(set));
    return result_.sets.size() - 1;
  }
  /// The place of the set, fitted now if it was not before.
  size_t fitted(const std::vector<rig::Ingredient>& ingredients);
  /// chi-square with what its parameters cost.
  [[nodiscard]] double penalised(size_t set) const {
    const FittedSet& at = result_.sets[set];
    return at.chi_square + (at.fit.ingredients.empty() ? 0.0 : cost(at));
  }
  [[nodiscard]] static double cost(const FittedSet& set) {
    double sum = 0.0;
    for (const rig::Ingredient& ingredient : set.fit.ingredients)
      sum += admission(ingredient.effect->parameters().size());
    return sum;
  }
  std::vector<size_t> grow(size_t from);
  void compare_alike(size_t set);
  void tell(const std::string& text) const {
    if (options_.progress) options_.progress(text);
  }

  const rig::Session& session_;
  const rig::SpecimenFamily& family_;
  const rig::RigProblem& problem_;
  const SearchOptions& options_;
  Eigen::VectorXd weights_;
  SearchResult result_;
};

size_t Search::fitted(const std::vector<rig::Ingredient>& ingredients) {
  const std::vector<std::string> ids = ids_of(ingredients);
  for (size_t k = 0; k < result_.sets.size(); ++k)
    if (result_.sets[k].ids() == ids) return k;
  tell(fmt::format("fitting {}", fmt::join(ids, " + ")));
  return add(problem_.fit(ingredients));
}

/// The sets with one effect more that a screening finds worth a fit.
std::vector<size_t> Search::grow(size_t from) {
  const rig::RigFit current = result_.sets[from].fit;
  tell(current.ingredients.empty() ? "screening the effects"
                                   : fmt::format("screening beside {}", fmt::join(ids_of(current.ingredients), " + ")));
  const std::vector<Lead> leads =
      screen(problem_, family_, session_, current, weights_, [this] { tell(""); });
  if (from == 0) result_.leads = leads;
  std::vector<size_t> grown;
  for (const Lead& lead : leads) {
    if (grown.size() >= options_.refitted || lead.gain < admission(lead.parameters)) break;
    std::vector<rig::Ingredient> ingredients = current.ingredients;
    ingredients.push_back(lead.ingredient);
    grown.push_back(fitted(ingredients));
  }
  std::sort(grown.begin(), grown.end(), [this](size_t a, size_t b) { return penalised(a) < penalised(b); });
  return grown;
}

/// Each member of the set replaced by what looks like it.
void Search::compare_alike(size_t set) {
  const std::vector<rig::Ingredient> chosen = result_.sets[set].fit.ingredients;
  for (size_t member = 0; member < chosen.size(); ++member) {
    for (const std::string_view id : chosen[member].effect->text().conflicts) {
      const Effect* other = find_effect(id);
      if (other == nullptr || !other->fits(family_) || other->occasions() != Occasions::none) continue;
      std::vector<rig::Ingredient> swapped = chosen;
      swapped[member] = {other, {}};
      const std::vector<std::string> ids = ids_of(swapped);
      if (std::adjacent_find(ids.begin(), ids.end()) == ids.end()) fitted(swapped);
    }
  }
}

SearchResult Search::run() {
  std::vector<size_t> beam{0};
  for (size_t effects = 0; effects < options_.most_effects; ++effects) {
    std::vector<size_t> grown;
    for (const size_t from : beam) {
      for (const size_t set : grow(from))
        if (penalised(set) < penalised(from)) grown.push_back(set);
    }
    std::sort(grown.begin(), grown.end(), [this](size_t a, size_t b) { return penalised(a) < penalised(b); });
    grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
    if (grown.empty() || penalised(grown.front()) >= penalised(result_.best)) break;
    result_.best = grown.front();
    grown.resize(std::min(grown.size(), options_.beam));
    beam = grown;
  }
  compare_alike(result_.best);
  for (size_t k = 0; k < result_.sets.size(); ++k)
    if (penalised(k) < penalised(result_.best)) result_.best = k;
  return std::move(result_);
}

}  // namespace

std::vector<std::string> FittedSet::ids() const { return ids_of(fit.ingredients); }

size_t FittedSet::parameters() const {
  size_t count = 0;
  for (const rig::Ingredient& ingredient : fit.ingredients)
    count += ingredient.effect->parameters().size();
  return count;
}

double admission(size_t parameters) { return chi_square_exceeded(1e-7, static_cast<double>(parameters)); }

Eigen::VectorXd row_weights(const rig::Session& session, const rig::RigProblem& problem) {
  Eigen::VectorXd variance = model_variance(problem, {});
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

SearchResult search(const rig::Session& session, const rig::SpecimenFamily& family, const rig::RigProblem& problem,
                    const SearchOptions& options) {
  return Search(session, family, problem, options).run();
}

}  // namespace diastole::explain
