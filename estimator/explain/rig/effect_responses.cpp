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

/// Simulates effects one by one, at sizes that are set ever closer where the changes that they make differ in shape.
class ResponseScan {
 public:
  ResponseScan(const rig::SessionProblem& problem, const rig::LinearisedModel& known, const VectorXd& scale)
      : problem_(problem), known_(known), scale_(scale), neutral_of_(problem.model(known.at)) {
    const auto is_in_base = [&](const Effect* effect) {
      return std::ranges::any_of(known.at.terms, [&](const ModelTerm& in) { return in.effect == effect; });
    };
    for (const Effect* effect : problem.session().effects.of_rig())
      if (effect->fits(problem.family()) && effect->change_points() == ChangePoints::none &&
          !is_in_base(effect))
        std::ranges::copy(variants_of(*effect), std::back_inserter(variants_));
    seen_ = magnitudes(problem.features(), known.misfit(problem).cwiseQuotient(scale)).normalized();
  }

  void scan_first_sizes() {
    std::vector<Wanted> wanted;
    for (size_t v = 0; v < variants_.size(); ++v)
      for (const double size : first_sizes)
        wanted.push_back({v, size});
    simulate(wanted);
  }

  /// A quarter of the smallest size: in proportion to it, where four times as much is.
  void add_smaller_sizes() {
    std::vector<Wanted> wanted;
    for (size_t i = 0, count = all_.size(); i < count; ++i) {
      if (all_[i].size != first_sizes[0]) continue;
      const size_t v = all_[i].variant;
      const double size = smaller * first_sizes[0];
      if (i + 1 < count && all_[i + 1].variant == v && all_[i + 1].size == first_sizes[1] &&
          is_in_proportion(all_[i], all_[i + 1], scale_)) {
        Sized small = all_[i];
        small.size = size;
        small.response.values = variants_[v].values(variants_[v].effect->neutral(neutral_of_), size);
        small.response.change *= smaller;
        all_.push_back(std::move(small));
      } else {
        wanted.push_back({v, size});
      }
    }
    simulate(wanted);
  }

  /// Sizes between neighbours whose changes differ in shape, the likely ones alone in later rounds. False: there are none.
  bool halve_differing(size_t round) {
    std::ranges::sort(all_, {}, [](const Sized& one) { return std::pair(one.variant, one.size); });
    std::vector<Interval> differing;
    for (size_t i = 0; i + 1 < all_.size(); ++i) {
      if (all_[i].variant != all_[i + 1].variant) continue;
      const VectorXd a = all_[i].response.change.cwiseQuotient(scale_);
      const VectorXd b = all_[i + 1].response.change.cwiseQuotient(scale_);
      if (b.norm() < visible || a.dot(b) > alike * a.norm() * b.norm()) continue;
      differing.push_back({all_[i].variant, std::sqrt(all_[i].size * all_[i + 1].size),
                           std::max(all_[i].likeness, all_[i + 1].likeness)});
    }
    std::ranges::sort(differing, [](const Interval& a, const Interval& b) {
      return a.variant != b.variant ? a.variant < b.variant : a.likeness > b.likeness;
    });
    std::vector<Wanted> wanted;
    for (size_t i = 0, rank = 0; i < differing.size(); ++i) {
      rank = i > 0 && differing[i].variant == differing[i - 1].variant ? rank + 1 : 0;
      if (round < halvings_everywhere || rank < likely_intervals)
        wanted.push_back({differing[i].variant, differing[i].middle});
    }
    simulate(wanted);
    return !wanted.empty();
  }

  [[nodiscard]] std::vector<Response> take() {
    std::vector<Response> list;
    for (Sized& one : all_)
      list.push_back(std::move(one.response));
    return list;
  }

 private:
  struct Wanted {
    size_t variant;
    double size;
  };
  /// Between two sizes.
  struct Interval {
    size_t variant;
    double middle, likeness;
  };

  /// Adds those that have values within their bounds and a solution.
  void simulate(const std::vector<Wanted>& wanted) {
    if (wanted.empty()) return;
    std::vector<SessionModel> models{known_.at};
    std::vector<bool> same_plant{true};
    std::vector<Sized> made;
    for (const auto& [v, size] : wanted) {
      const Variant& variant = variants_[v];
      const std::vector<double> values = variant.values(variant.effect->neutral(neutral_of_), size);
      if (values.empty()) continue;
      made.push_back({v, size, {{variant.effect, {}}, values, {}}});
      models.push_back(known_.at);
      models.back().terms.push_back({variant.effect, {}});
      models.back().values.insert(models.back().values.end(), values.begin(), values.end());
      same_plant.push_back(variant.effect->stage() == Stage::sensors);
    }
    const Eigen::MatrixXd shown = problem_.predicted_features(models, same_plant);
    for (size_t i = 0; i < made.size(); ++i) {
      made[i].response.change = shown.col(static_cast<Eigen::Index>(i + 1)) - known_.there;
      const VectorXd own = magnitudes(problem_.features(), made[i].response.change.cwiseQuotient(scale_));
      made[i].likeness = own.dot(seen_) / std::max(own.norm(), 1e-9);
    }
    std::erase_if(made, [](const Sized& one) { return !one.response.change.allFinite(); });
    std::ranges::move(made, std::back_inserter(all_));
  }

  const rig::SessionProblem& problem_;
  const rig::LinearisedModel& known_;
  const VectorXd& scale_;
  const rig::RigModel neutral_of_;
  std::vector<Variant> variants_;
  VectorXd seen_;  ///< the misfit's sizes
  std::vector<Sized> all_;
};

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
  ResponseScan scan(problem, known, scale);
  scan.scan_first_sizes();
  scan.add_smaller_sizes();
  size_t round = 0;
  while (round < most_halvings && scan.halve_differing(round))
    ++round;
  return scan.take();
}

}  // namespace diastole::explain
