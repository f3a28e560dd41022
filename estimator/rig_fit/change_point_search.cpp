#include "estimator/rig_fit/change_point_search.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "estimator/rig_fit/search_scale.hpp"

namespace diastole::rig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double least_gain = 40.0;  ///< of a moment: chance finds some 20 among the samples of a session
constexpr double least_part =
    0.001;  ///< of what is above the noise, by the first: else something else is the matter
constexpr size_t most_change_points = 12;
/// How far the scan may err, which sees lasting changes and not the blow when steps are lost.
constexpr double level_reach_s = 0.3;
constexpr double blow_reach_s = 2.0;

struct Candidate {
  size_t run = 0;
  size_t sample = 0;
  double gain = 0.0;
  double amplitude = 0.0;
};

class ChangePointSearch {
 public:
  ChangePointSearch(const RigProblem& problem, const Session& session, const RigFit& before,
                    const Effect& effect)
      : problem_(problem), session_(session), fit_(before), known_(before.values.size()) {
    fit_.terms.push_back({&effect, {}});
    for (const EffectParameter& parameter : effect.parameters())
      typical_.push_back(parameter.typical);
    fit_.values.insert(fit_.values.end(), typical_.begin(), typical_.end());
    fit_.values[known_] = 0.0;
    order_.resize(session.runs.size());
    std::iota(order_.begin(), order_.end(), size_t{0});
    std::sort(order_.begin(), order_.end(), [&](size_t a, size_t b) {
      return session.runs[a].drive.place.started_s < session.runs[b].drive.place.started_s;
    });
    lasts_ = effect.change_points() == ChangePoints::one;
    set_lasting_change();
  }

  std::optional<FoundChangePoints> run();
  std::optional<PromisedChangePoints> promise();

 private:
  [[nodiscard]] const std::vector<ChangePoint>& change_points() const {
    return fit_.terms.back().change_points;
  }
  std::vector<ChangePoint>& change_points() { return fit_.terms.back().change_points; }
  [[nodiscard]] ChangePoint change_point(size_t run, double time_s) const {
    const RunPlace& place = session_.runs[run].drive.place;
    return {place.name, time_s, place.started_s + time_s};
  }
  void set_lasting_change();
  [[nodiscard]] Candidate scan() const;
  /// The least gain of a next moment that counts, of what was above the noise at first.
  [[nodiscard]] double least(size_t moments, double excess) const {
    return std::max(least_gain, moments == 0 ? least_part * excess : 0.0);
  }
  [[nodiscard]] size_t most() const { return lasts_ ? 1 : most_change_points; }
  [[nodiscard]] double excess() const {
    return std::max(fit_.residuals.squaredNorm() - static_cast<double>(fit_.count), 0.0);
  }
  [[nodiscard]] VectorXd lasting_from(const Candidate& at) const;
  /// When the candidate happened, by the whole of its change; `amplitude` is its size then.
  [[nodiscard]] double shifted_s(const Candidate& at, double& amplitude) const;
  bool refine(int steps);
  [[nodiscard]] MatrixXd time_columns() const;
  [[nodiscard]] size_t run_of(const ChangePoint& moment) const {
    for (size_t r = 0; r < session_.runs.size(); ++r)
      if (session_.runs[r].drive.place.name == moment.run) return r;
    return 0;
  }

  const RigProblem& problem_;
  const Session& session_;
  RigFit fit_;
  size_t known_;  ///< values before the effect's
  std::vector<double> typical_;
  std::vector<size_t> order_;  ///< of the runs in time
  bool lasts_ = false;         ///< into later runs
  VectorXd lasting_;           ///< change of the residuals by one unit of the first parameter
};

void ChangePointSearch::set_lasting_change() {
  std::vector<ModelTerm> there = fit_.terms;
  for (const size_t run : order_) {
    there.back().change_points.push_back(change_point(run, session_.runs[run].sample_s.front() - 10.0));
    if (lasts_) break;
  }
  std::vector<double> values = fit_.values;
  values[known_] = 0.3 * typical_[0];
  std::vector<ModelTerm> known = fit_.terms;
  known.pop_back();
  const std::vector<double> before(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(known_));
  lasting_ = (problem_.residuals(there, values, for_differences) -
              problem_.residuals(known, before, for_differences)) /
             values[known_];
}

Candidate ChangePointSearch::scan() const {
  const Index count = fit_.jacobian.cols();
  MatrixXd normal = fit_.jacobian.transpose() * fit_.jacobian;
  for (Index i = 0; i < count; ++i)
    normal(i, i) = normal(i, i) > 0.0 ? normal(i, i) * (1.0 + 1e-9) : 1.0;
  const MatrixXd inverse = normal.inverse();
  const VectorXd pulled = inverse * (fit_.jacobian.transpose() * fit_.residuals);
  const double sign = change_points().empty() ? 0.0 : fit_.values[known_];

  Candidate best;
  double along = 0.0;
  double square = 0.0;
  VectorXd shared = VectorXd::Zero(count);
  for (auto run = order_.rbegin(); run != order_.rend(); ++run) {
    if (!lasts_) {
      along = square = 0.0;
      shared.setZero();
    }
    std::vector<size_t> firsts;
    for (const ResidualBlock& block : problem_.blocks())
      if (block.run == *run && block.channel != "cavity_mL") firsts.push_back(block.first);
    for (size_t k = session_.runs[*run].sample_s.size(); k-- > 0;) {
      for (const size_t first : firsts) {
        const auto row = static_cast<Index>(first + k);
        along -= lasting_[row] * fit_.residuals[row];
        square += lasting_[row] * lasting_[row];
        shared += lasting_[row] * fit_.jacobian.row(row).transpose();
      }
      const double free = square - shared.dot(inverse * shared);
      if (free < 0.02 * square || free <= 0.0) continue;
      const double slope = along + shared.dot(pulled);
      const double gain = slope * slope / free;
      if (gain > best.gain && slope * sign >= 0.0) best = {*run, k, gain, slope / free};
    }
  }
  return best;
}

VectorXd ChangePointSearch::lasting_from(const Candidate& at) const {
  VectorXd change = VectorXd::Zero(lasting_.size());
  const auto place = std::find(order_.begin(), order_.end(), at.run);
  for (const ResidualBlock& block : problem_.blocks()) {
    const auto run = std::find(order_.begin(), order_.end(), block.run);
    if (block.channel == "cavity_mL" || run < place || (run > place && !lasts_)) continue;
    const size_t skipped = run == place ? std::min(at.sample, block.count) : 0;
    const auto first = static_cast<Index>(block.first + skipped);
    const auto count = static_cast<Index>(block.count - skipped);
    change.segment(first, count) = lasting_.segment(first, count);
  }
  return change;
}

/// The best step along the columns of `known` and `change`: least squares; unknowns that nothing sees stay.
VectorXd step_along(const MatrixXd& known, const VectorXd& change, const VectorXd& residuals) {
  MatrixXd all(change.size(), known.cols() + 1);
  all << known, change;
  MatrixXd normal = all.transpose() * all;
  for (Index i = 0; i < normal.rows(); ++i)
    normal(i, i) = normal(i, i) > 0.0 ? normal(i, i) * (1.0 + 1e-9) : 1.0;
  return -normal.ldlt().solve(all.transpose() * residuals);
}

double ChangePointSearch::shifted_s(const Candidate& at, double& amplitude) const {
  const SessionRun& run = session_.runs[at.run];
  std::vector<ModelTerm> more = fit_.terms;
  more.back().change_points.push_back(change_point(at.run, run.sample_s[at.sample]));
  std::vector<double> values = fit_.values;
  if (change_points().empty()) values[known_] = at.amplitude;
  const VectorXd change = problem_.residuals(more, values, for_differences) -
                          problem_.residuals(fit_.terms, fit_.values, for_differences);
  // What is left when the other unknowns have given way to the change where it was found.
  const VectorXd move = step_along(fit_.jacobian, change, fit_.residuals);
  const VectorXd left = fit_.residuals + fit_.jacobian * move.head(fit_.jacobian.cols());
  const double size = move[fit_.jacobian.cols()];
  const double spacing_s =
      (run.sample_s.back() - run.sample_s.front()) / static_cast<double>(run.sample_s.size() - 1);
  const auto reach = static_cast<Index>((lasts_ ? level_reach_s : blow_reach_s) / spacing_s);
  Index best = 0;
  double best_gain = -1e300;
  for (Index shift = -reach; shift <= reach; ++shift) {
    double along = 0.0;
    double square = 0.0;
    for (const ResidualBlock& block : problem_.blocks()) {
      if (block.run != at.run || block.channel == "cavity_mL") continue;
      const auto count = static_cast<Index>(block.count);
      const Index first = std::max({Index{0}, shift, static_cast<Index>(at.sample) - 2 * reach});
      const Index last = std::min({count, count + shift, static_cast<Index>(at.sample) + 4 * reach});
      if (last <= first) continue;
      const auto moved = change.segment(static_cast<Index>(block.first) + first - shift, last - first);
      along -= moved.dot(left.segment(static_cast<Index>(block.first) + first, last - first));
      square += moved.squaredNorm();
    }
    // A sensor's step has the size that was found; a blow has any.
    const double gain = lasts_ ? size * (2.0 * along - size * square) : along * std::abs(along) / square;
    if (gain > best_gain) {
      best_gain = gain;
      best = shift;
      amplitude = lasts_ ? size : along / square;
    }
  }
  amplitude *= values[known_];
  return run.sample_s[at.sample] + static_cast<double>(best) * spacing_s;
}

MatrixXd ChangePointSearch::time_columns() const {
  constexpr double perturbation_s = 2e-4;
  const std::vector<ChangePoint>& moments = fit_.terms.back().change_points;
  MatrixXd columns(fit_.residuals.size(), static_cast<Index>(moments.size()));
  for (size_t m = 0; m < moments.size(); ++m) {
    FitRequest one = for_differences;
    one.runs.assign(session_.runs.size(), false);
    one.runs[run_of(moments[m])] = true;
    std::vector<ModelTerm> moved = fit_.terms;
    const auto at = [&](double by_s) {
      moved.back().change_points[m].time_s = moments[m].time_s + by_s;
      moved.back().change_points[m].session_s = moments[m].session_s + by_s;
      return problem_.residuals(moved, fit_.values, one);
    };
    columns.col(static_cast<Index>(m)) = (at(perturbation_s) - at(-perturbation_s)) / (2.0 * perturbation_s);
  }
  return columns;
}

/// Values and moments together, damped until chi-square falls. Sensors that step between two samples have no slope by
/// their moment.
bool ChangePointSearch::refine(int steps) {
  constexpr double farthest_s = 0.01;
  const auto coordinates = search_coordinates(fit_.terms, problem_.unknowns(fit_.terms));
  const auto values = static_cast<Index>(fit_.values.size());
  double damping = 1e-6;
  bool better = false;
  for (int step = 0; step < steps; ++step) {
    const MatrixXd times = time_columns();
    MatrixXd all(fit_.residuals.size(), values + times.cols());
    all << problem_.columns(fit_.terms, fit_.values), times;
    const MatrixXd normal = all.transpose() * all;
    const VectorXd gradient = all.transpose() * fit_.residuals;
    const double before = fit_.residuals.squaredNorm();
    double gained = 0.0;
    for (int tries = 0; tries < 6 && gained <= 0.0; ++tries) {
      MatrixXd system = normal;
      for (Index i = 0; i < system.rows(); ++i)
        system(i, i) = system(i, i) > 0.0 ? system(i, i) * (1.0 + damping) : 1.0;
      const VectorXd move = -system.ldlt().solve(gradient);
      RigFit next = fit_;
      for (Index i = 0; i < values; ++i) {
        const auto k = static_cast<size_t>(i);
        const SearchCoordinate& coordinate = coordinates[k];
        const double at = to_search(coordinate.scale, fit_.values[k]) + move[i];
        next.values[k] = from_search(coordinate.scale, std::clamp(at, coordinate.lower, coordinate.upper));
      }
      for (Index m = 0; m < times.cols(); ++m) {
        const double by_s = std::clamp(move[values + m], -farthest_s, farthest_s);
        next.terms.back().change_points[static_cast<size_t>(m)].time_s += by_s;
        next.terms.back().change_points[static_cast<size_t>(m)].session_s += by_s;
      }
      next.residuals = problem_.residuals(next.terms, next.values);
      gained = before - next.residuals.squaredNorm();
      damping = gained > 0.0 ? std::max(0.1 * damping, 1e-9) : std::max(30.0 * damping, 1e-3);
      if (!(gained > 0.0)) continue;
      fit_.values = std::move(next.values);
      fit_.terms = std::move(next.terms);
      fit_.residuals = std::move(next.residuals);
      better = true;
    }
    fit_.jacobian = all.leftCols(values);
    if (gained < 0.1) break;
  }
  return better;
}

std::optional<FoundChangePoints> ChangePointSearch::run() {
  const double at_first = fit_.residuals.squaredNorm();
  const double above_noise = excess();
  while (change_points().size() < most()) {
    const Candidate found = scan();
    if (found.gain < least(change_points().size(), above_noise)) break;
    const RigFit kept = fit_;
    double amplitude = found.amplitude;
    const double at_s = shifted_s(found, amplitude);
    if (change_points().empty()) fit_.values[known_] = amplitude;
    change_points().push_back(change_point(found.run, at_s));
    fit_.residuals = problem_.residuals(fit_.terms, fit_.values);
    refine(3);
    if (kept.residuals.squaredNorm() - fit_.residuals.squaredNorm() < least_gain) {
      fit_ = kept;
      break;
    }
  }
  if (change_points().empty()) return {};
  if (!lasts_) refine(6);
  FoundChangePoints found;
  found.fit = problem_.fit_from(fit_.terms, fit_.values);
  found.term = found.fit.terms.back();
  found.values.assign(found.fit.values.begin() + static_cast<std::ptrdiff_t>(known_), found.fit.values.end());
  found.gain = at_first - found.fit.chi_square;
  return found;
}

std::optional<PromisedChangePoints> ChangePointSearch::promise() {
  const double above_noise = excess();
  PromisedChangePoints promised;
  for (; promised.count < most(); ++promised.count) {
    const Candidate found = scan();
    if (found.gain < least(promised.count, above_noise)) break;
    const VectorXd change = lasting_from(found);
    const VectorXd move = step_along(fit_.jacobian, change, fit_.residuals);
    fit_.residuals += fit_.jacobian * move.head(fit_.jacobian.cols()) + change * move[fit_.jacobian.cols()];
  }
  if (promised.count == 0) return {};
  promised.residuals = std::move(fit_.residuals);
  return promised;
}

}  // namespace

std::optional<PromisedChangePoints> promise_change_points(const RigProblem& problem, const Session& session,
                                                          const RigFit& before, const Effect& effect) {
  if (effect.change_points() == ChangePoints::none) return {};
  return ChangePointSearch(problem, session, before, effect).promise();
}

std::optional<FoundChangePoints> find_change_points(const RigProblem& problem, const Session& session,
                                                    const RigFit& before, const Effect& effect) {
  if (effect.change_points() == ChangePoints::none) return {};
  return ChangePointSearch(problem, session, before, effect).run();
}

}  // namespace diastole::rig
