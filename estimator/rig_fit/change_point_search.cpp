#include "estimator/rig_fit/change_point_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "estimator/inference/least_squares.hpp"
#include "estimator/rig_fit/linear_basis.hpp"

namespace diastole::rig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double least_gain =
    40.0;  ///< of a change point: chance finds some 20 among the samples of a session
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
  /// The least gain of a next change point that counts, of what was above the noise at first.
  [[nodiscard]] double least(size_t points, double excess) const {
    return std::max(least_gain, points == 0 ? least_part * excess : 0.0);
  }
  [[nodiscard]] size_t most() const { return lasts_ ? 1 : most_change_points; }
  [[nodiscard]] double excess() const {
    return std::max(fit_.residuals.squaredNorm() - static_cast<double>(fit_.count), 0.0);
  }
  [[nodiscard]] VectorXd lasting_from(const Candidate& at) const;
  /// When the candidate happened, by the whole of its change; `amplitude` is its size then.
  [[nodiscard]] double shifted_s(const Candidate& at, double& amplitude) const;
  void refine(int steps);

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
  KnownModel there = fit_;
  there.values[known_] = 0.3 * typical_[0];
  for (const size_t run : order_) {
    there.terms.back().change_points.push_back(change_point(run, session_.runs[run].sample_s.front() - 10.0));
    if (lasts_) break;
  }
  KnownModel before = fit_;
  before.terms.pop_back();
  before.values.resize(known_);
  lasting_ = (problem_.residuals(there, for_differences) - problem_.residuals(before, for_differences)) /
             there.values[known_];
}

Candidate ChangePointSearch::scan() const {
  const MatrixXd known = basis_of(fit_.jacobian);  // what the other unknowns take up
  const VectorXd pulled = known.transpose() * fit_.residuals;
  const double sign = change_points().empty() ? 0.0 : fit_.values[known_];

  Candidate best;
  double along = 0.0;
  double square = 0.0;
  VectorXd shared = VectorXd::Zero(known.cols());
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
        shared += lasting_[row] * known.row(row).transpose();
      }
      const double free = square - shared.squaredNorm();
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
  return all.colPivHouseholderQr().solve(-residuals);
}

double ChangePointSearch::shifted_s(const Candidate& at, double& amplitude) const {
  const SessionRun& run = session_.runs[at.run];
  KnownModel more = fit_;
  more.terms.back().change_points.push_back(change_point(at.run, run.sample_s[at.sample]));
  if (change_points().empty()) more.values[known_] = at.amplitude;
  const VectorXd change =
      problem_.residuals(more, for_differences) - problem_.residuals(fit_, for_differences);
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
  amplitude *= more.values[known_];
  return run.sample_s[at.sample] + static_cast<double>(best) * spacing_s;
}

/// The unknowns of a fit and the times of its last term's change points, as shifts of where they are.
class ShiftedChangePoints : public inference::LeastSquaresProblem {
 public:
  ShiftedChangePoints(const RigProblem& rig, const Session& session, const KnownModel& from)
      : rig_(rig), session_(session), from_(from) {
    const std::vector<Unknown> unknowns = rig.unknowns(from.terms);
    std::vector<inference::Parameter> parameters(unknowns.begin(), unknowns.end());
    for (const ChangePoint& at : from.terms.back().change_points)
      parameters.push_back({.name = "time of a change point of " + at.run, .unit = "s"});
    space_ = inference::ParameterSpace(std::move(parameters));
  }
  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  /// The model with its change points shifted.
  [[nodiscard]] KnownModel at(const VectorXd& q) const {
    KnownModel shifted = from_;
    std::vector<double> values = space_.values(q);
    const auto unknowns = values.begin() + static_cast<std::ptrdiff_t>(shifted.values.size());
    for (size_t m = 0; m < shifted.terms.back().change_points.size(); ++m)
      shift(shifted, m, unknowns[static_cast<std::ptrdiff_t>(m)]);
    shifted.values.assign(values.begin(), unknowns);
    return shifted;
  }
  std::optional<VectorXd> residuals(const VectorXd& q) override {
    VectorXd found = rig_.residuals(at(q));
    if (!found.allFinite()) return {};
    return found;
  }
  MatrixXd jacobian(const VectorXd& q) override {
    constexpr double perturbation_s = 2e-4;
    const KnownModel here = at(q);
    const std::vector<ChangePoint>& points = here.terms.back().change_points;
    MatrixXd all = rig_.columns(here);
    const Index unknowns = all.cols();
    all.conservativeResize(Eigen::NoChange, q.size());
    for (size_t m = 0; m < points.size(); ++m) {
      FitRequest one = for_differences;
      for (const SessionRun& run : session_.runs)
        one.runs.push_back(run.drive.place.name == points[m].run);
      const auto moved = [&](double by_s) {
        KnownModel other = here;
        shift(other, m, by_s);
        return rig_.residuals(other, one);
      };
      all.col(unknowns + static_cast<Index>(m)) =
          (moved(perturbation_s) - moved(-perturbation_s)) / (2.0 * perturbation_s);
    }
    return all;
  }

 private:
  static void shift(KnownModel& model, size_t point, double by_s) {
    model.terms.back().change_points[point].time_s += by_s;
    model.terms.back().change_points[point].session_s += by_s;
  }
  const RigProblem& rig_;
  const Session& session_;
  const KnownModel& from_;
  inference::ParameterSpace space_;
};

/// Values and change points together. Sensors that step between two samples have no slope by their change point.
void ChangePointSearch::refine(int steps) {
  constexpr double farthest_s = 0.01;
  const KnownModel from = fit_;
  ShiftedChangePoints problem(problem_, session_, from);
  const auto unknowns = static_cast<Index>(from.values.size());
  VectorXd start = VectorXd::Zero(problem.space().size());
  for (Index i = 0; i < unknowns; ++i)
    start[i] = problem.space()[i].coordinate(from.values[static_cast<size_t>(i)]);
  inference::SearchOptions options;
  options.iteration_limit = steps;
  options.small_gain = [](double) { return 0.1; };
  options.refusal_limit = 6;
  options.first_radius = 1e6;
  options.longest_step = VectorXd::Constant(start.size(), std::numeric_limits<double>::infinity());
  options.longest_step.tail(start.size() - unknowns).setConstant(farthest_s);
  inference::SearchResult found = minimise(problem, start, options);
  if (found.termination == inference::Termination::no_solution) return;
  static_cast<KnownModel&>(fit_) = problem.at(found.q);
  fit_.residuals = std::move(found.residuals);
  fit_.jacobian = found.jacobian.leftCols(unknowns);
}

std::optional<FoundChangePoints> ChangePointSearch::run() {
  const double at_first = fit_.residuals.squaredNorm();
  const double above_noise = excess();
  while (change_points().size() < most()) {
    const Candidate found = scan();
    if (found.gain < least(change_points().size(), above_noise)) break;
    RigFit kept = fit_;
    double amplitude = found.amplitude;
    const double at_s = shifted_s(found, amplitude);
    if (change_points().empty()) fit_.values[known_] = amplitude;
    change_points().push_back(change_point(found.run, at_s));
    fit_.residuals = problem_.residuals(fit_);
    refine(3);
    if (kept.residuals.squaredNorm() - fit_.residuals.squaredNorm() < least_gain) {
      fit_ = std::move(kept);
      break;
    }
  }
  if (change_points().empty()) return {};
  if (!lasts_) refine(6);
  FoundChangePoints found;
  found.fit = problem_.fit_from(fit_);
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
