#include "estimator/imaging/series/phase_order.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

constexpr size_t fewest_phases = 5;
constexpr double most_step = 4.0, most_detour = 2.0;

/// Mean squares of the differences of all pairs.
class Differences {
 public:
  explicit Differences(const std::vector<Image>& phases) : count_(phases.size()), squares_(count_ * count_) {
    for (size_t a = 0; a < count_; ++a)
      for (size_t b = 0; b < a; ++b)
        squares_[a * count_ + b] = squares_[b * count_ + a] =
            static_cast<double>((phases[a] - phases[b]).square().mean());
  }
  [[nodiscard]] double operator()(size_t a, size_t b) const { return squares_[a * count_ + b]; }
  /// From phase to phase.
  [[nodiscard]] std::vector<double> steps(const std::vector<size_t>& order) const {
    std::vector<double> all;
    for (size_t k = 1; k < order.size(); ++k)
      all.push_back((*this)(order[k], order[k - 1]));
    return all;
  }

 private:
  size_t count_;
  std::vector<double> squares_;
};

std::optional<PhaseOrder::LeftOut> left_out(const Differences& square, size_t phase, size_t count,
                                            double usual) {
  if (phase == 0) return {};
  if (square(phase, phase - 1) == 0) return PhaseOrder::LeftOut{phase, phase - 1};
  if (phase + 1 == count) return {};
  if (square(phase, phase + 1) == 0) return PhaseOrder::LeftOut{phase, phase + 1};
  const double least = std::min(square(phase, phase - 1), square(phase, phase + 1));
  const double around = square(phase - 1, phase + 1);
  if (least <= most_step * usual || least <= most_detour * around) return {};
  return PhaseOrder::LeftOut{phase, {}, std::sqrt(least / std::max(around, 1e-300))};
}

std::optional<PhaseOrder::Exchange> exchange(const Differences& square, std::vector<size_t> order) {
  const auto way = [&] {
    const std::vector<double> steps = square.steps(order);
    return std::accumulate(steps.begin(), steps.end(), 0.0);
  };
  const double usual = signal::quantile(square.steps(order), 0.5);
  const double as_it_is = way();
  double shortest = as_it_is;
  PhaseOrder::Exchange best{};
  for (size_t a = 1; a < order.size(); ++a) {
    for (size_t b = a + 1; b < order.size(); ++b) {
      std::swap(order[a], order[b]);
      const double length = way();
      std::swap(order[a], order[b]);
      if (length >= shortest) continue;
      shortest = length;
      best = {order[a], order[b], 1 - length / as_it_is};
    }
  }
  return as_it_is - shortest > most_step * usual ? std::optional(best) : std::nullopt;
}

}  // namespace

PhaseOrder order_of_phases(const std::vector<Image>& phases) {
  PhaseOrder found;
  std::vector<size_t> all(phases.size());
  std::iota(all.begin(), all.end(), size_t{0});
  if (phases.size() < fewest_phases) return {.kept = all, .left_out = {}, .exchange = {}};
  const Differences square(phases);
  const double usual = signal::quantile(square.steps(all), 0.75);
  if (usual == 0)
    return {.kept = all, .left_out = {}, .exchange = {}};  // nothing moves, and there is no noise
  for (const size_t phase : all) {
    if (const auto out = left_out(square, phase, phases.size(), usual))
      found.left_out.push_back(*out);
    else
      found.kept.push_back(phase);
  }
  if (found.kept.size() >= fewest_phases) found.exchange = exchange(square, found.kept);
  return found;
}

}  // namespace diastole::imaging
