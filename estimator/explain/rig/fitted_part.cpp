#include "estimator/explain/rig/fitted_part.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/explain/rig/screening.hpp"
#include "estimator/explain/rig/synergy_scan.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Is more than half of what an effect changes what a tolerance changes that is so far off in a set that the effect may be the more
/// probable of both? What the two leave of each other no linear algebra shows: their curvature is more.
bool relieves(const Effect* effect, const EffectSet& set, const std::vector<Response>& responses) {
  const VectorXd weight = set.evidence.variance.cwiseSqrt().cwiseInverse();
  const Index tolerances = set.model.nuisances.size() - static_cast<Index>(rig::basic_nuisances);
  for (Index i = 0; i < tolerances; ++i) {
    if (std::pow(set.model.nuisances.tail(tolerances)[i], 2) < least_gain) continue;
    const VectorXd strained = weight.cwiseProduct(set.columns.rightCols(tolerances).col(i)).normalized();
    for (const Response& response : responses)
      if (response.term.effect == effect &&
          std::pow(strained.dot(weight.cwiseProduct(response.change).normalized()), 2) > 0.5)
        return true;
  }
  return false;
}

/// What moments do has none.
bool has_response(const Effect* effect, const std::vector<Response>& responses) {
  return effect->change_points() == ChangePoints::none &&
         std::ranges::any_of(responses,
                             [&](const Response& response) { return response.term.effect == effect; });
}

/// The most that responses of these effects promise together, one of each.
Screening::Joined most_joined(const Screening& screening, const std::vector<Response>& responses,
                              std::span<const Effect* const> effects, const std::vector<size_t>& chosen) {
  if (effects.empty()) return screening.joined(chosen);
  Screening::Joined most;
  for (size_t i = 0; i < responses.size(); ++i) {
    if (responses[i].term.effect != effects.front()) continue;
    std::vector<size_t> with = chosen;
    with.push_back(i);
    const Screening::Joined joined = most_joined(screening, responses, effects.subspan(1), with);
    if (joined.gain > most.gain) most = joined;
  }
  return most;
}

}  // namespace

std::optional<double> posterior_by_part(const EffectSet& set, std::span<const EffectSet> fitted,
                                        const std::vector<Response>& responses) {
  const auto is_in = [](const Effect* effect, const EffectSet& of) {
    return std::ranges::count(of.model.terms, effect, &rig::ModelTerm::effect) > 0;
  };
  for (const EffectSet& part : fitted) {
    const bool is_part = part.model.terms.size() < set.model.terms.size() &&
                         std::ranges::all_of(part.model.terms, [&](const rig::ModelTerm& term) {
                           return is_in(term.effect, set);
                         });
    if (!part.exact || !is_part || part.log_posterior < set.log_posterior) continue;
    std::vector<const Effect*> others;
    for (const rig::ModelTerm& term : set.model.terms)
      if (!is_in(term.effect, part)) others.push_back(term.effect);
    const auto is_nonlinear = [&](const Effect* other) {
      return !has_response(other, responses) || relieves(other, part, responses) ||
             std::ranges::any_of(set.model.terms, [&](const rig::ModelTerm& term) {
               return only_show_together(*other, *term.effect);
             });
    };
    if (std::ranges::any_of(others, is_nonlinear)) continue;
    const Screening::Joined most =
        most_joined(Screening(responses, part.target(), part.columns, part.evidence), responses, others, {});
    const double odds =
        set.log_posterior - set.evidence.log_evidence - (part.log_posterior - part.evidence.log_evidence);
    if (most.gain < least_gain * static_cast<double>(others.size()))
      return part.log_posterior + most.log_evidence + odds;
  }
  return {};
}

}  // namespace diastole::explain
