#include "estimator/explain/rig/synergy_scan.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include "estimator/explain/rig/effect_responses.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using rig::SessionModel;
using Pair = std::pair<const Effect*, const Effect*>;

std::vector<Pair> declared_pairs(const rig::SessionProblem& problem, const SessionModel& base) {
  const EffectLibrary& library = problem.session().effects;
  const auto may_be = [&](const Effect* effect) {
    return effect != nullptr && effect->fits(problem.family()) &&
           effect->change_points() == ChangePoints::none &&
           std::ranges::count(base.terms, effect, &rig::ModelTerm::effect) == 0;
  };
  std::vector<Pair> pairs;
  for (const Effect* one : library.of_rig())
    for (const std::string_view id : one->text().synergies) {
      const Effect* other = library.find(id);
      if (may_be(one) && may_be(other) && std::ranges::count(pairs, Pair{other, one}) == 0)
        pairs.emplace_back(one, other);
    }
  return pairs;
}

/// With both at each of their sizes.
std::vector<SessionModel> models_with(const Pair& pair, const rig::RigModel& rig, const SessionModel& base) {
  std::vector<SessionModel> models;
  const auto values_of = [&](const Effect& effect, double size) {
    return sized_values(effect, effect.neutral(rig), std::vector<bool>(effect.parameters().size(), true),
                        size);
  };
  for (const double size : first_sizes)
    for (const double other_size : first_sizes) {
      const std::vector<double> values = values_of(*pair.first, size);
      const std::vector<double> others = values_of(*pair.second, other_size);
      if (values.empty() || others.empty()) continue;
      SessionModel model = base;
      for (const auto& [effect, of] : {std::pair(pair.first, &values), std::pair(pair.second, &others)}) {
        model.terms.push_back({effect, {}});
        model.values.insert(model.values.end(), of->begin(), of->end());
      }
      models.push_back(model);
      model.nuisances[0] = 0.0;
      models.push_back(std::move(model));
    }
  return models;
}

}  // namespace

bool only_show_together(const Effect& one, const Effect& other) {
  return std::ranges::count(one.text().synergies, other.text().id) > 0 ||
         std::ranges::count(other.text().synergies, one.text().id) > 0;
}

std::vector<SessionModel> scan_synergies(const rig::SessionProblem& problem,
                                         const rig::LinearisedModel& declared) {
  std::vector<std::pair<double, SessionModel>> best;
  const rig::RigModel rig = problem.model(declared.at);
  for (const Pair& pair : declared_pairs(problem, declared.at)) {
    std::vector<SessionModel> models = models_with(pair, rig, declared.at);
    const Eigen::MatrixXd shown = problem.predicted_features(models);
    std::optional<std::pair<double, size_t>> found;
    for (size_t i = 0; i < models.size(); ++i) {
      const auto seen = shown.col(static_cast<Index>(i));
      if (!seen.allFinite()) continue;
      const double evidence =
          fit_with_shares(problem.measured() - seen + declared.columns * models[i].nuisances,
                          declared.columns, problem.error(), problem.error().prior.share)
              .log_evidence;
      if (!found || evidence > found->first) found = {evidence, i};
    }
    if (found) best.emplace_back(found->first, std::move(models[found->second]));
  }
  std::ranges::sort(best, std::greater(), [](const auto& one) { return one.first; });
  std::vector<SessionModel> starts;
  for (auto& [evidence, model] : best)
    starts.push_back(std::move(model));
  return starts;
}

}  // namespace diastole::explain
