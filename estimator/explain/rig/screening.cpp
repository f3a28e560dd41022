#include "estimator/explain/rig/screening.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string_view>
#include <utility>

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Of a response: beyond, another size stands for it.
constexpr double least_amplitude = 0.5, most_amplitude = 2.0;

double amplitude(double along, double square) {
  return square > 0.0 ? std::clamp(along / square, least_amplitude, most_amplitude) : 1.0;
}

/// The best gain of each set of ids, the largest first.
class ScreenedSets {
 public:
  explicit ScreenedSets(const std::vector<Response>& responses) : responses_(responses) {}
  void add(ScreenedSet candidate) {
    std::vector<std::string_view> ids;
    for (const size_t i : candidate.responses)
      ids.push_back(responses_[i].term.effect->text().id);
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    ScreenedSet& best = best_[ids];
    if (candidate.gain > best.gain) best = std::move(candidate);
  }
  [[nodiscard]] std::vector<ScreenedSet> sorted() const {
    std::vector<ScreenedSet> list;
    for (const auto& [ids, candidate] : best_)
      if (!candidate.responses.empty()) list.push_back(candidate);
    std::ranges::sort(list, std::greater(), &ScreenedSet::gain);
    return list;
  }

 private:
  const std::vector<Response>& responses_;
  std::map<std::vector<std::string_view>, ScreenedSet> best_;
};

}  // namespace

Screening::Screening(const std::vector<Response>& responses, const VectorXd& misfit, const MatrixXd& columns,
                     const rig::EvidenceFit& under)
    : responses_(responses) {
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

double Screening::single(size_t i) const {
  const double a = amplitude(along(i), square(i));
  return a * (2.0 * along(i) - a * square(i));
}

double Screening::pair(size_t i, size_t j) const {
  const double both = product(i, j);
  double a = 1.0;
  double b = 1.0;
  for (int round = 0; round < 6; ++round) {  // of a box-bounded quadratic, from its middle
    a = amplitude(along(i) - b * both, square(i));
    b = amplitude(along(j) - a * both, square(j));
  }
  return 2.0 * (a * along(i) + b * along(j)) - a * a * square(i) - b * b * square(j) - 2.0 * a * b * both;
}

Screening::Joined Screening::joined(std::vector<size_t> responses) const {
  const auto count = static_cast<Index>(responses.size());
  if (count == 0) return {};
  VectorXd b(count);
  MatrixXd squares(count, count);
  for (Index i = 0; i < count; ++i) {
    b[i] = along(responses[static_cast<size_t>(i)]);
    for (Index j = 0; j < count; ++j)
      squares(i, j) = product(responses[static_cast<size_t>(i)], responses[static_cast<size_t>(j)]);
  }
  const VectorXd amplitudes = squares.ldlt().solve(b);
  Index least = 0;
  if (!(amplitudes.minCoeff(&least) > 0.0)) {
    responses.erase(responses.begin() + least);
    return joined(std::move(responses));
  }
  MatrixXd with_prior = squares;
  with_prior.diagonal() += amplitudes.cwiseAbs2().cwiseInverse();
  const MatrixXd scaled = amplitudes.asDiagonal() * with_prior * amplitudes.asDiagonal();
  return {.gain = amplitudes.dot(b),
          .log_evidence = 0.5 * (b.dot(with_prior.ldlt().solve(b)) - std::log(scaled.determinant()))};
}

std::vector<ScreenedSet> Screening::sets(bool pairs) const {
  ScreenedSets best(responses_);
  for (size_t i = 0; i < responses_.size(); ++i) {
    if (!pairs) best.add({single(i), {i}});
    for (size_t j = i + 1; j < responses_.size(); ++j)
      if ((responses_[i].term.effect != responses_[j].term.effect) == pairs) best.add({pair(i, j), {i, j}});
  }
  return best.sorted();
}

std::vector<ScreenedSet> Screening::singles_but(const Effect* effect) const {
  ScreenedSets best(responses_);
  for (size_t i = 0; i < responses_.size(); ++i)
    if (responses_[i].term.effect != effect) best.add({single(i), {i}});
  return best.sorted();
}

bool is_worth_fitting(const std::vector<ScreenedSet>& sorted, size_t i, double least) {
  constexpr size_t first = 3;
  return sorted[i].gain > least && (i < first || sorted[i].gain > 0.5 * sorted.front().gain);
}

}  // namespace diastole::explain
