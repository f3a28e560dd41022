#include "estimator/imaging/series/phase_order.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

constexpr size_t fewest_phases = 5;
constexpr double most_step = 4.0, most_detour = 2.0;
/// Of an eigenvalue that holds noise alone, over their median: of as many as there are phases the largest is hardly twice as large.
constexpr double most_noise = 3.0;
/// Within a motion that goes on, two images that have each other's time make it go back and forth: two turns at least. That an order with
/// as many turns has a shorter way says nothing: a motion may fall faster than it rises.
constexpr size_t turns_of_exchange = 2;
/// Two that are exchanged are looked for within a quarter of the cycle: in farther ones another tag may lie where the first one lay.
constexpr size_t least_reach = 3;

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
  /// Of these phases and without the noise: distances in the space that holds more than it (multidimensional scaling, Torgerson 1952). Noise adds
  /// as much to each of its directions, of which most have nothing else.
  [[nodiscard]] Differences without_noise(const std::vector<size_t>& phases) const;
  /// From phase to phase.
  [[nodiscard]] std::vector<double> steps(const std::vector<size_t>& order) const {
    std::vector<double> all;
    for (size_t k = 1; k < order.size(); ++k)
      all.push_back((*this)(order[k], order[k - 1]));
    return all;
  }

 private:
  explicit Differences(size_t count) : count_(count), squares_(count * count) {}
  size_t count_;
  std::vector<double> squares_;
};

Differences Differences::without_noise(const std::vector<size_t>& phases) const {
  const auto count = static_cast<Eigen::Index>(phases.size());
  Eigen::MatrixXd products(count, count);  // of the phases, their mean taken off
  for (Eigen::Index a = 0; a < count; ++a)
    for (Eigen::Index b = 0; b < count; ++b)
      products(a, b) = -0.5 * (*this)(phases[static_cast<size_t>(a)], phases[static_cast<size_t>(b)]);
  products.rowwise() -= products.colwise().mean().eval();
  products.colwise() -= products.rowwise().mean().eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(products);
  const Eigen::VectorXd& values = solver.eigenvalues();  // ascending; one of them is 0, of the mean
  const double noise =
      std::max(0.0, signal::quantile(std::vector<double>(values.data(), values.data() + count), 0.5));
  const Eigen::VectorXd beyond =
      (values.array() > most_noise * noise).select((values.array() - noise).max(0.0), 0.0);
  const Eigen::MatrixXd places = solver.eigenvectors() * beyond.cwiseSqrt().asDiagonal();
  Differences clean(phases.size());
  for (Eigen::Index a = 0; a < count; ++a)
    for (Eigen::Index b = 0; b < count; ++b)
      clean.squares_[static_cast<size_t>(a * count + b)] = (places.row(a) - places.row(b)).squaredNorm();
  return clean;
}

/// The last has one neighbour. A motion that jumps there goes where it has been.
std::optional<PhaseOrder::LeftOut> last_unlike_all(const Differences& square, size_t last, double usual) {
  double least = std::numeric_limits<double>::infinity(), largest_step = 0;
  for (size_t k = 0; k < last; ++k) {
    least = std::min(least, square(last, k));
    if (k > 0) largest_step = std::max(largest_step, square(k, k - 1));
  }
  if (least <= most_step * usual || least <= most_detour * largest_step) return {};
  return PhaseOrder::LeftOut{last, {}, std::sqrt(least / std::max(largest_step, 1e-300))};
}

std::optional<PhaseOrder::LeftOut> left_out(const Differences& square, size_t phase, size_t count,
                                            double usual) {
  if (phase == 0) return {};
  if (square(phase, phase - 1) == 0) return PhaseOrder::LeftOut{phase, phase - 1};
  if (phase + 1 == count) return last_unlike_all(square, phase, usual);
  if (square(phase, phase + 1) == 0) return PhaseOrder::LeftOut{phase, phase + 1};
  const double least = std::min(square(phase, phase - 1), square(phase, phase + 1));
  const double around = square(phase - 1, phase + 1);
  if (least <= most_step * usual || least <= most_detour * around) return {};
  return PhaseOrder::LeftOut{phase, {}, std::sqrt(least / std::max(around, 1e-300))};
}

/// How often the motion turns back.
size_t turns(const Differences& square, const std::vector<size_t>& order) {
  size_t count = 0;
  for (size_t k = 1; k + 1 < order.size(); ++k)
    if (square(order[k - 1], order[k + 1]) < square(order[k - 1], order[k]) + square(order[k], order[k + 1]))
      ++count;
  return count;
}

std::optional<PhaseOrder::Exchange> exchange(const Differences& square, const std::vector<size_t>& phases) {
  std::vector<size_t> order(phases.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto way = [&] {
    const std::vector<double> steps = square.steps(order);
    return std::accumulate(steps.begin(), steps.end(), 0.0);
  };
  const size_t turns_as_it_is = turns(square, order);
  const double as_it_is = way();
  // A usual step of what moves: most of a cycle may be rest.
  const double usual =
      std::max(signal::quantile(square.steps(order), 0.75), as_it_is / static_cast<double>(order.size() - 1));
  const size_t reach = std::max(least_reach, order.size() / 4);
  double shortest = as_it_is;
  PhaseOrder::Exchange best{};
  for (size_t a = 1; a < order.size(); ++a) {
    for (size_t b = a + 1; b < std::min(a + reach + 1, order.size()); ++b) {
      std::swap(order[a], order[b]);
      const double length = way();
      const size_t left = turns(square, order);
      std::swap(order[a], order[b]);
      if (length >= shortest || left + turns_of_exchange > turns_as_it_is) continue;
      shortest = length;
      best = {phases[a], phases[b], 1 - length / as_it_is};
    }
  }
  return as_it_is - shortest > usual ? std::optional(best) : std::nullopt;
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
  if (found.kept.size() >= fewest_phases)
    found.exchange = exchange(square.without_noise(found.kept), found.kept);
  return found;
}

}  // namespace diastole::imaging
