#include "estimator/explain/rig/set_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "estimator/inference/information.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/least_squares.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::ParameterSpace;
using rig::SessionModel;
using rig::Unknown;

/// ln of a size's density, uniform in its logarithm over two decades on one side or both, relative to the normal about 0.
constexpr double size_range = 4.6;
constexpr double small_part = 5e-4;  ///< of a size, for derivatives: a tenth of how well large ones are known
constexpr double time_step_s = 0.02;  ///< some samples: less is as rough as they are
constexpr double bound_u = 8.0;       ///< of a nuisance, in sds: no data move one so far

/// Whether the nuisances but the modulus follow by columns taken at a known model, or are simulated.
enum class Nuisances { linear, simulated };

/// What is searched: the effects' values, the modulus and the other nuisances; the moments are held.
class SetProblem : public inference::LeastSquaresProblem {
 public:
  SetProblem(const rig::SessionProblem& problem, const SessionModel& start, rig::LinearisedModel known,
             Nuisances nuisances)
      : problem_(problem), start_(start), known_(std::move(known)), kind_(nuisances) {
    const rig::RigModel base = problem.model({{}, {}, start.nuisances, start.prior});
    size_t at = 0;
    for (const rig::ModelTerm& term : start.terms) {
      const std::vector<double> neutral = term.effect->neutral(base);
      for (size_t j = 0; j < neutral.size(); ++j, ++at) {
        const EffectParameter& parameter = term.effect->parameters()[j];
        Unknown unknown = rig::unknown_of(*term.effect, parameter);
        const auto [lower, upper] = unknown.coordinate_bounds();
        const double from = unknown.coordinate(neutral[j]);
        const double size = std::abs(unknown.coordinate(start.values[at]) - from);
        const double typical = std::abs(unknown.coordinate(parameter.typical) - from);
        unknown.perturbation = small_part * (is_amplitude(*term.effect, j) ? std::max(size, 0.3 * typical)
                                                                           : 0.3 * (upper - lower));
        unknowns_.push_back(unknown);
        neutral_.push_back(is_amplitude(*term.effect, j) ? std::optional(from) : std::nullopt);
      }
    }
    values_ = unknowns_.size();
    for (const rig::ModelTerm& term : start.terms)
      for (const ChangePoint& moment : term.change_points) {
        Unknown unknown{
            {.name = "moment", .unit = "s", .lower = moment.time_s - 1.0, .upper = moment.time_s + 1.0},
            time_step_s,
            false};
        unknowns_.push_back(unknown);
        neutral_.emplace_back();
      }
    const double u0 = start.nuisances[0];
    unknowns_.push_back({{.name = "modulus", .lower = u0 - 3.0, .upper = u0 + 3.0}, 2e-3, false});
    neutral_.emplace_back();
    std::vector<inference::Parameter> all(unknowns_.begin(), unknowns_.end());
    for (Index i = 1; i < start.nuisances.size(); ++i)
      all.push_back(
          {.name = problem.nuisances()[static_cast<size_t>(i)].name, .lower = -bound_u, .upper = bound_u});
    space_ = ParameterSpace(std::move(all));
  }

  void set_variance(const VectorXd& variance) { weight_ = variance.cwiseSqrt().cwiseInverse(); }
  [[nodiscard]] const ParameterSpace& space() const override { return space_; }
  [[nodiscard]] inference::Linearisation linearisation() const override {
    return inference::Linearisation::kept;
  }
  std::optional<VectorXd> residuals(const VectorXd& q) override {
    const VectorXd seen = features(q);
    if (!seen.allFinite()) return {};
    const VectorXd u = nuisances(q);
    VectorXd found(seen.size() + u.size());
    found.head(seen.size()) = (problem_.measured() - seen).cwiseProduct(weight_);
    found.tail(u.size()) = u;
    return found;
  }
  MatrixXd jacobian(const VectorXd& q) override {
    const MatrixXd columns = derivatives(q);
    MatrixXd all = MatrixXd::Zero(columns.rows() + start_.nuisances.size(), columns.cols());
    all.topRows(columns.rows()) = -(weight_.asDiagonal() * columns);
    all.bottomRightCorner(start_.nuisances.size(), start_.nuisances.size()).setIdentity();
    return all;
  }
  /// Derivatives of what is shown, as a search had them at its end.
  void take(const inference::SearchResult& found) {
    derivatives_ = -(weight_.cwiseInverse().asDiagonal() * found.jacobian.topRows(weight_.size()));
    derived_at_ = found.q;
  }

  /// Derivatives by differences to both sides from now on; whether they were to one.
  bool differ_to_both_sides() {
    derived_at_.resize(0);
    return !std::exchange(both_sides_, true);
  }

  /// Which of the unknowns are moments.
  [[nodiscard]] std::vector<bool> moments() const {
    std::vector<bool> list(static_cast<size_t>(space_.size()), false);
    std::fill(list.begin() + effect_values(), list.begin() + searched() - 1, true);
    return list;
  }
  [[nodiscard]] Index searched() const { return static_cast<Index>(unknowns_.size()); }
  [[nodiscard]] Index effect_values() const { return static_cast<Index>(values_); }
  [[nodiscard]] const std::vector<Unknown>& unknowns() const { return unknowns_; }
  /// The coordinate at which an amplitude does nothing.
  [[nodiscard]] std::optional<double> neutral(Index i) const { return neutral_[static_cast<size_t>(i)]; }
  [[nodiscard]] VectorXd start() const {
    VectorXd q(space_.size());
    for (Index i = 0; i < effect_values(); ++i)
      q[i] = unknowns_[static_cast<size_t>(i)].coordinate(start_.values[static_cast<size_t>(i)]);
    Index at = effect_values();
    for (const rig::ModelTerm& term : start_.terms)
      for (const ChangePoint& moment : term.change_points)
        q[at++] = moment.time_s;
    q[at++] = start_.nuisances[0];
    q.tail(start_.nuisances.size() - 1) = start_.nuisances.tail(start_.nuisances.size() - 1);
    return space_.clamped(q);
  }
  [[nodiscard]] VectorXd nuisances(const VectorXd& q) const {
    VectorXd u(start_.nuisances.size());
    u[0] = q[searched() - 1];
    u.tail(u.size() - 1) = q.tail(u.size() - 1);
    return u;
  }
  /// The model of a point.
  [[nodiscard]] SessionModel model(const VectorXd& q) const {
    SessionModel made = start_;
    for (Index i = 0; i < effect_values(); ++i)
      made.values[static_cast<size_t>(i)] = unknowns_[static_cast<size_t>(i)].value(q[i]);
    Index at = effect_values();
    for (rig::ModelTerm& term : made.terms)
      for (ChangePoint& moment : term.change_points) {
        moment.session_s += q[at] - moment.time_s;
        moment.time_s = q[at++];
      }
    made.nuisances = nuisances(q);
    return made;
  }
  VectorXd features(const VectorXd& q) {
    const VectorXd now = simulated(q);
    if (now.size() != at_.size() || now != at_) {
      at_ = now;
      seen_ = problem_.predicted_features(std::array{simulated_model(q)});
    }
    if (kind_ == Nuisances::simulated) return seen_;
    return seen_ +
           known_.columns.rightCols(others()) * (q.tail(others()) - known_.at.nuisances.tail(others()));
  }
  /// Of what is shown by q.
  const MatrixXd& derivatives(const VectorXd& q) {
    const VectorXd now = simulated(q);
    if (derived_at_.size() == q.size() && simulated(derived_at_) == now) return derivatives_;
    derivatives_.resize(problem_.measured().size(), q.size());
    Index others_from = searched();
    if (kind_ == Nuisances::simulated) {
      known_.at = model(q);
      known_.columns = problem_.nuisance_slopes(known_.at, known_.there, both_sides_);
      seen_ = known_.there;
      --others_from;  // the modulus is one of them
    }
    derivatives_.rightCols(q.size() - others_from) = known_.columns.rightCols(q.size() - others_from);
    if (others_from > 0) derive_searched(q, others_from);
    at_ = now;
    derived_at_ = q;
    return derivatives_;
  }

 private:
  /// Derivatives by the first of the unknowns.
  void derive_searched(const VectorXd& q, Index count) {
    std::vector<SessionModel> models{simulated_model(q)};
    std::vector<bool> same_plant{true};
    std::vector<double> steps;
    const auto add = [&](Index i, double step) {
      VectorXd moved = q;
      moved[i] += step;
      models.push_back(simulated_model(moved));
      same_plant.push_back(unknowns_[static_cast<size_t>(i)].sensors_only);
    };
    for (Index i = 0; i < count; ++i) {
      steps.push_back(unknowns_[static_cast<size_t>(i)].step_from(q[i]));
      add(i, steps.back());
    }
    // One that is nearer to its bound than that is differenced to one side.
    std::vector<Index> before(static_cast<size_t>(count), 0);
    for (Index i = 0; both_sides_ && i < count; ++i) {
      const double step = steps[static_cast<size_t>(i)];
      const double moved = q[i] - step;
      if (moved < space_.lower()[i] || moved > space_.upper()[i]) continue;
      before[static_cast<size_t>(i)] = static_cast<Index>(models.size());
      add(i, -step);
    }
    const MatrixXd all = problem_.predicted_features(models, same_plant);
    seen_ = all.col(0);
    for (Index i = 0; i < count; ++i) {
      const Index other = before[static_cast<size_t>(i)];
      derivatives_.col(i) =
          (all.col(i + 1) - all.col(other)) / (steps[static_cast<size_t>(i)] * (other > 0 ? 2.0 : 1.0));
    }
  }

  const rig::SessionProblem& problem_;
  /// What the simulation depends on.
  [[nodiscard]] VectorXd simulated(const VectorXd& q) const {
    return kind_ == Nuisances::simulated ? q : VectorXd(q.head(searched()));
  }
  [[nodiscard]] SessionModel simulated_model(const VectorXd& q) const {
    SessionModel made = model(q);
    if (kind_ == Nuisances::linear) made.nuisances.tail(others()) = known_.at.nuisances.tail(others());
    return made;
  }
  /// Nuisances but the modulus.
  [[nodiscard]] Index others() const { return start_.nuisances.size() - 1; }

  const SessionModel& start_;
  rig::LinearisedModel known_;
  Nuisances kind_;
  bool both_sides_ = false;
  std::vector<Unknown> unknowns_;
  std::vector<std::optional<double>> neutral_;
  size_t values_ = 0;
  ParameterSpace space_;
  VectorXd weight_;
  VectorXd at_, seen_, derived_at_;
  MatrixXd derivatives_;
};

/// Width of what a value may be before the data: its size, or its bounds'.
double prior_width(const SetProblem& set, const VectorXd& q, Index i) {
  const Unknown& unknown = set.unknowns()[static_cast<size_t>(i)];
  const auto [lower, upper] = unknown.coordinate_bounds();
  if (const auto neutral = set.neutral(i)) return std::max(std::abs(q[i] - *neutral), unknown.perturbation);
  return (upper - lower) / std::sqrt(12.0);
}

double log_prior(const rig::SessionProblem& problem, const SetProblem& set, const SessionModel& model) {
  double sum = 0.0;
  for (const rig::ModelTerm& term : model.terms) {
    sum += std::log(effect_odds);
    double cycles = 0.0;
    for (const rig::SessionRun& run : problem.session().runs)
      cycles += static_cast<double>(run.drive.place.trigger_s.size());
    sum -= static_cast<double>(term.change_points.size()) * std::log(std::max(cycles, 2.0));
  }
  for (Index i = 0; i < set.effect_values(); ++i)
    if (const auto neutral = set.neutral(i)) {
      const auto [lower, upper] = set.unknowns()[static_cast<size_t>(i)].coordinate_bounds();
      const bool both_sides = lower < *neutral && *neutral < upper;
      sum -= std::log(size_range * (both_sides ? 2.0 : 1.0) / std::sqrt(2.0 * std::numbers::pi));
    }
  return sum;
}

EffectSet search(const rig::SessionProblem& problem, SetProblem& set, const rig::LinearisedModel& known,
                 const rig::Shares& shares, double best_so_far) {
  constexpr double out_of_reach = 50.0;  // nats: rounds after the first bring some
  constexpr int most_rounds = 6;
  EffectSet out;
  VectorXd q = set.start();
  const Index searched = set.searched();
  const Index others = q.size() - searched;
  MatrixXd& columns = out.columns;
  const auto judged = [&](const rig::Shares& from) {
    columns = set.derivatives(q);
    VectorXd z = problem.measured() - set.features(q) + columns.rightCols(others + 1) * q.tail(others + 1);
    for (Index i = 0; i + 1 < searched; ++i)
      columns.col(i) *= prior_width(set, q, i);
    return fit_with_shares(z, columns, problem.error(), from);
  };
  out.evidence = judged(shares);
  SetRound round;
  for (int i = 0; i < most_rounds && !round.is_at_rest(); ++i) {
    set.set_variance(out.evidence.variance);
    inference::SearchOptions options;
    options.iteration_limit = 40;  // a bubble and its exponent go a long way along a valley
    options.small_gain = [](double) { return 1.0; };  // half a nat decides nothing
    options.refusal_limit =
        12;  // divide the largest radius, 1e16, by 2^78: before, a step may still be a whole one
    options.first_radius = 1e4;
    options.held = set.moments();  // event_scan.hpp; what is shown changes by leaps with them
    const inference::SearchResult found = minimise(set, q, options);
    round = {.values = found.termination, .crept = found.crept, .is_first = i == 0};
    if (found.termination == inference::Termination::no_solution) break;
    q = found.q;
    // Slopes by differences to one side hold curvature: a search that they end goes on with those to both.
    round.is_repeated = found.termination == inference::Termination::stalled && set.differ_to_both_sides();
    if (!round.is_repeated) set.take(found);
    const double before = out.evidence.log_evidence;
    out.evidence = judged(out.evidence.shares);
    round.shares = out.evidence.termination;
    round.moved_nats = std::abs(out.evidence.log_evidence - before);
    if (out.evidence.log_evidence + log_prior(problem, set, set.model(q)) < best_so_far - out_of_reach) break;
  }
  out.termination = round.termination();
  out.model = set.model(q);
  out.known = {.at = out.model, .there = set.features(q), .columns = known.columns};
  out.known.columns.col(0) = columns.col(searched - 1);
  out.known.columns.rightCols(others) = columns.rightCols(others);
  out.unknowns.assign(set.unknowns().begin(), set.unknowns().begin() + set.effect_values());
  out.covariance = inference::covariance_of_information(out.precision_by_data()).matrix;
  for (Index i = 0; i + 1 < searched; ++i) {
    const double width = prior_width(set, q, i);
    out.covariance.row(i) *= width;
    out.covariance.col(i) *= width;
  }
  for (Index i = 0; i < set.effect_values(); ++i)
    out.errors.push_back(inference::standard_error(set.space()[i], q[i], std::sqrt(out.covariance(i, i))));
  out.evidence.left = problem.measured() - out.known.there;
  out.log_posterior = out.evidence.log_evidence + log_prior(problem, set, out.model);
  return out;
}

}  // namespace

bool SetRound::has_no_end() const { return crept || values == inference::Termination::iteration_limit; }

bool SetRound::is_at_rest() const {
  constexpr double decides_nothing = 0.5;
  return !is_repeated && !(has_no_end() && is_first) && inference::is_settled(shares) &&
         moved_nats < decides_nothing;
}

inference::Termination SetRound::termination() const {
  if (is_at_rest()) return has_no_end() ? inference::Termination::converged : values;
  return inference::is_settled(values) ? inference::Termination::iteration_limit : values;
}

EffectSet fit_set(const rig::SessionProblem& problem, const SessionModel& start,
                  const rig::LinearisedModel& known, const rig::Shares& shares, double best_so_far) {
  SetProblem set(problem, start, known, Nuisances::linear);
  return search(problem, set, known, shares, best_so_far);
}

EffectSet fit_set_exactly(const rig::SessionProblem& problem, const EffectSet& near) {
  SetProblem set(problem, near.model, near.known, Nuisances::simulated);
  EffectSet found =
      search(problem, set, near.known, near.evidence.shares, -std::numeric_limits<double>::infinity());
  found.exact = true;
  return found;
}

}  // namespace diastole::explain
