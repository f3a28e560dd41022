#include "estimator/explain/rig/effect_responses.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace diastole::explain {
namespace {

using Eigen::VectorXd;
using rig::ModelTerm;
using rig::SessionModel;

/// A curve of values through an effect's parameters: which amplitudes grow with the size.
struct Variant {
  const Effect* effect;
  std::vector<bool> grows;
  double sign;

  [[nodiscard]] std::vector<double> values(const std::vector<double>& neutral, double size) const {
    return sized_values(*effect, neutral, grows, sign * size);
  }
};

std::vector<Variant> variants_of(const Effect& effect) {
  const size_t count = effect.parameters().size();
  std::vector<size_t> amplitudes;
  for (size_t j = 0; j < count; ++j)
    if (is_amplitude(effect, j)) amplitudes.push_back(j);
  std::vector<Variant> list;
  for (const double sign : {1.0, -1.0}) {
    std::vector<bool> all(count, false);
    for (const size_t j : amplitudes) {
      std::vector<bool> one(count, false);
      one[j] = all[j] = true;
      if (amplitudes.size() > 1) list.push_back({&effect, one, sign});
    }
    list.push_back({&effect, all, sign});
  }
  return list;
}

constexpr double smaller = 0.25;  ///< of the smallest of them
constexpr double alike = 0.9;     ///< cosine
constexpr double visible = 3.0;   ///< sds in all: less is indistinguishable from nothing
constexpr size_t halvings_everywhere = 2;
constexpr size_t most_halvings = 6;
constexpr size_t likely_intervals = 3;  ///< of a variant, that are halved further

/// Of each harmonic the length of its features, in sds: what a resonance shows whatever its phase.
VectorXd magnitudes(const rig::SegmentFeatures& features, const VectorXd& whitened) {
  VectorXd list = VectorXd::Zero(whitened.size());
  for (const rig::FeatureBlock& block : features.blocks()) {
    auto at = static_cast<Eigen::Index>(block.first);
    const rig::Feature* before = nullptr;
    for (size_t i = 0; i < block.features.size(); ++i) {
      const rig::Feature& feature = block.features[i];
      const auto row = static_cast<Eigen::Index>(block.first + i);
      if (before == nullptr || before->kind != feature.kind || before->harmonic != feature.harmonic) at = row;
      list[at] = std::hypot(list[at], whitened[row]);
      before = &feature;
    }
  }
  return list;
}

struct Sized {
  size_t variant;
  double size;
  Response response;
  double likeness = 0.0;  ///< cosine of its magnitudes and the misfit's
};

/// Whether changes grow with the sizes, within a tenth: an effect's own error.
bool is_in_proportion(const Sized& one, const Sized& larger, const VectorXd& scale) {
  constexpr double within = 0.1;
  const VectorXd a = (larger.size / one.size * one.response.change).cwiseQuotient(scale);
  const VectorXd b = larger.response.change.cwiseQuotient(scale);
  return (b - a).norm() < within * a.norm();
}

}  // namespace

bool is_amplitude(const Effect& effect, size_t parameter) {
  const EffectParameter& at = effect.parameters()[parameter];
  return parameter == 0 || (at.scale == SearchScale::linear && at.neutral == 0.0 && at.lower == 0.0);
}

std::vector<double> sized_values(const Effect& effect, const std::vector<double>& neutral,
                                 const std::vector<bool>& grows, double size) {
  std::vector<double> list;
  for (size_t j = 0; j < neutral.size(); ++j) {
    const EffectParameter& parameter = effect.parameters()[j];
    if (is_amplitude(effect, j)) {
      list.push_back(grows[j] ? rig::sized_value(parameter, neutral[j], size) : neutral[j]);
    } else {
      list.push_back(parameter.typical);
    }
    if (!(list.back() >= parameter.lower && list.back() <= parameter.upper)) return {};
  }
  return list;
}

std::vector<Response> effect_responses(const rig::SessionProblem& problem, const rig::LinearisedModel& known,
                                       const VectorXd& scale) {
  const SessionModel& base = known.at;
  std::vector<Variant> variants;
  for (const Effect* effect : problem.session().effects.of_rig())
    if (effect->fits(problem.family()) && effect->change_points() == ChangePoints::none &&
        std::ranges::none_of(base.terms, [&](const ModelTerm& in) { return in.effect == effect; }))
      std::ranges::copy(variants_of(*effect), std::back_inserter(variants));
  const VectorXd seen =
      magnitudes(problem.features(), known.misfit(problem).cwiseQuotient(scale)).normalized();
  const rig::RigModel neutral_of = problem.model(base);
  const auto simulate = [&](const std::vector<std::pair<size_t, double>>& wanted) {
    std::vector<SessionModel> models{base};
    std::vector<bool> same_plant{true};
    std::vector<Sized> made;
    for (const auto& [v, size] : wanted) {
      const Variant& variant = variants[v];
      const std::vector<double> values = variant.values(variant.effect->neutral(neutral_of), size);
      if (values.empty()) continue;
      made.push_back({v, size, {{variant.effect, {}}, values, {}}});
      models.push_back(base);
      models.back().terms.push_back({variant.effect, {}});
      models.back().values.insert(models.back().values.end(), values.begin(), values.end());
      same_plant.push_back(variant.effect->stage() == Stage::sensors);
    }
    const Eigen::MatrixXd shown = problem.shown(models, same_plant);
    for (size_t i = 0; i < made.size(); ++i) {
      made[i].response.change = shown.col(static_cast<Eigen::Index>(i + 1)) - known.there;
      const VectorXd own = magnitudes(problem.features(), made[i].response.change.cwiseQuotient(scale));
      made[i].likeness = own.dot(seen) / std::max(own.norm(), 1e-9);
    }
    std::erase_if(made, [](const Sized& one) { return !one.response.change.allFinite(); });
    return made;
  };
  std::vector<std::pair<size_t, double>> wanted;
  for (size_t v = 0; v < variants.size(); ++v)
    for (const double size : first_sizes)
      wanted.emplace_back(v, size);
  std::vector<Sized> all = simulate(wanted);
  // A quarter of the smallest size: in proportion to it, where four times as much is.
  wanted.clear();
  for (size_t i = 0, count = all.size(); i < count; ++i) {
    if (all[i].size != first_sizes[0]) continue;
    const auto [v, size] = std::pair(all[i].variant, smaller * first_sizes[0]);
    if (i + 1 < count && all[i + 1].variant == v && all[i + 1].size == first_sizes[1] &&
        is_in_proportion(all[i], all[i + 1], scale)) {
      Sized small = all[i];
      small.size = size;
      small.response.values = variants[v].values(variants[v].effect->neutral(neutral_of), size);
      small.response.change *= smaller;
      all.push_back(std::move(small));
    } else {
      wanted.emplace_back(v, size);
    }
  }
  std::vector<Sized> small = simulate(wanted);
  std::ranges::move(small, std::back_inserter(all));
  for (size_t round = 0; round < most_halvings; ++round) {
    std::ranges::sort(all, {}, [](const Sized& one) { return std::pair(one.variant, one.size); });
    struct Interval {
      size_t variant;
      double middle, likeness;
    };
    std::vector<Interval> differing;
    for (size_t i = 0; i + 1 < all.size(); ++i) {
      if (all[i].variant != all[i + 1].variant) continue;
      const VectorXd a = all[i].response.change.cwiseQuotient(scale);
      const VectorXd b = all[i + 1].response.change.cwiseQuotient(scale);
      if (b.norm() < visible || a.dot(b) > alike * a.norm() * b.norm()) continue;
      differing.push_back({all[i].variant, std::sqrt(all[i].size * all[i + 1].size),
                           std::max(all[i].likeness, all[i + 1].likeness)});
    }
    std::ranges::sort(differing, [](const Interval& a, const Interval& b) {
      return a.variant != b.variant ? a.variant < b.variant : a.likeness > b.likeness;
    });
    wanted.clear();
    for (size_t i = 0, rank = 0; i < differing.size(); ++i) {
      rank = i > 0 && differing[i].variant == differing[i - 1].variant ? rank + 1 : 0;
      if (round < halvings_everywhere || rank < likely_intervals)
        wanted.emplace_back(differing[i].variant, differing[i].middle);
    }
    if (wanted.empty()) break;
    std::vector<Sized> more = simulate(wanted);
    std::ranges::move(more, std::back_inserter(all));
  }
  std::vector<Response> list;
  for (Sized& one : all)
    list.push_back(std::move(one.response));
  return list;
}

}  // namespace diastole::explain
