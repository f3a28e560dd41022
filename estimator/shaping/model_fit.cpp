#include "estimator/shaping/model_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "estimator/inference/least_squares.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole::shaping {
namespace {

constexpr double range_part = 0.002, harmonic_part = 0.02;

inference::ParameterSpace space_of(const DriveModel& model) {
  std::vector<inference::Parameter> list;
  for (const LearnableEffect& one : model.effects())
    for (const EffectParameter& parameter : one.effect->parameters())
      list.push_back({std::string(parameter.name), std::string(parameter.unit), parameter.lower,
                      parameter.upper, parameter.scale});
  return inference::ParameterSpace(std::move(list));
}

class ModelFit final : public inference::LeastSquaresProblem {
 public:
  ModelFit(const DriveModel& model, std::span<const GatedRun> runs, double range_mL)
      : model_(model), runs_(runs), range_mL_(range_mL), space_(space_of(model)) {
    std::vector<double> values, typical;
    for (const LearnableEffect& one : model.effects()) {
      values.insert(values.end(), one.values.begin(), one.values.end());
      for (const EffectParameter& parameter : one.effect->parameters()) {
        typical.push_back(parameter.typical);
        effect_of_.push_back(one.effect);
      }
    }
    start_ = space_.coordinates(values);
    const Eigen::VectorXd far = space_.coordinates(typical);
    spread_ = (far - start_).cwiseAbs();
    // A value that is at its typical one already, or has none: a tenth of what is physical.
    for (Eigen::Index i = 0; i < spread_.size(); ++i) {
      const double tenth = 0.1 * (space_.upper()[i] - space_.lower()[i]);
      if (spread_[i] < 0.1 * tenth) spread_[i] = tenth;
    }
  }

  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  [[nodiscard]] inference::Linearisation linearisation() const override {
    return inference::Linearisation::kept;
  }
  /// Numbers that were measured.
  [[nodiscard]] double measured() const {
    double count = 0.0;
    for (const GatedRun& run : runs_)
      for (const double sigma : run.cavity_mL.sigma)
        count += std::isfinite(sigma) ? 2.0 : 0.0;
    return count;
  }
  /// Where searches begin: of single values moved, of pairs of the three that help most and of pairs that look alike those with the least misfit,
  /// one of each. Waves in a soft hose turn harmonics over, and gas before it as well: no descent finds them from a stiff one, nor from one that
  /// is too soft.
  [[nodiscard]] std::vector<Eigen::VectorXd> nearest_starts() const {
    constexpr size_t most = 6, pairing = 3;
    std::vector<Trial> trials = tried(moved_from(start_, 0, start_.size()));
    std::ranges::sort(trials, {}, &Trial::cost);
    std::vector<Eigen::Index> helpful;
    for (const Trial& trial : trials)
      if (helpful.size() < pairing && std::ranges::find(helpful, trial.moved) == helpful.end())
        helpful.push_back(trial.moved);
    const auto is_helpful = [&](Eigen::Index i) { return std::ranges::find(helpful, i) != helpful.end(); };
    std::vector<Trial> pairs;
    for (const Trial& trial : trials)
      for (Eigen::Index second = trial.moved + 1; second < start_.size(); ++second)
        if ((is_helpful(trial.moved) && is_helpful(second)) || look_alike(trial.moved, second))
          std::ranges::move(moved_from(trial.q, second, second + 1, trial.moved), std::back_inserter(pairs));
    std::ranges::move(tried(std::move(pairs)), std::back_inserter(trials));
    std::ranges::sort(trials, {}, &Trial::cost);
    std::vector<Eigen::VectorXd> starts;
    std::set<std::pair<Eigen::Index, Eigen::Index>> begun;
    for (const Trial& trial : trials)
      if (starts.size() < most && begun.emplace(trial.moved_before, trial.moved).second)
        starts.push_back(trial.q);
    return starts;
  }
  std::optional<Eigen::VectorXd> residuals(const Eigen::VectorXd& q) override {
    return at(q, machine_threads());
  }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& q) override {
    constexpr double part = 0.02;  // of the spread: above the simulation's own roughness
    const Eigen::VectorXd here = at(q, machine_threads());
    Eigen::MatrixXd columns(here.size(), q.size());
    parallel_for(static_cast<size_t>(q.size()), machine_threads(), [&](size_t index) {
      const auto i = static_cast<Eigen::Index>(index);
      Eigen::VectorXd moved = q;
      const double step = part * spread_[i];
      moved[i] += q[i] + step > space_.upper()[i] ? -step : step;
      columns.col(i) = (at(moved, 1) - here) / (moved[i] - q[i]);
    });
    return columns;
  }

 private:
  struct Trial {
    Eigen::VectorXd q;
    Eigen::Index moved = 0, moved_before = -1;
    double cost = 0.0;
  };
  /// Each of the values [from, to) moved by parts of its spread, as far as bounds allow.
  [[nodiscard]] std::vector<Trial> moved_from(const Eigen::VectorXd& q, Eigen::Index from, Eigen::Index to,
                                              Eigen::Index moved_before = -1) const {
    constexpr std::array parts{-4.0, -2.0, -1.0, -0.5, -0.25, 0.25, 0.5, 1.0, 2.0, 4.0};
    std::vector<Trial> trials;
    for (Eigen::Index i = from; i < to; ++i)
      for (const double part : parts) {
        Trial trial{.q = q, .moved = i, .moved_before = moved_before};
        trial.q[i] += part * spread_[i];
        if (trial.q == space_.clamped(trial.q)) trials.push_back(std::move(trial));
      }
    return trials;
  }
  /// Effects that are declared to: one alone is taken for the other, so that neither alone shows what both are.
  [[nodiscard]] bool look_alike(Eigen::Index one, Eigen::Index other) const {
    const auto conflicts = [](const Effect& a, const Effect& b) {
      return std::ranges::find(a.text().conflicts, b.text().id) != a.text().conflicts.end();
    };
    const Effect& first = *effect_of_[static_cast<size_t>(one)];
    const Effect& second = *effect_of_[static_cast<size_t>(other)];
    return conflicts(first, second) || conflicts(second, first);
  }
  [[nodiscard]] std::vector<Trial> tried(std::vector<Trial> trials) const {
    parallel_for(trials.size(), machine_threads(),
                 [&](size_t i) { trials[i].cost = at(trials[i].q, 1).squaredNorm(); });
    return trials;
  }
  [[nodiscard]] Eigen::VectorXd at(const Eigen::VectorXd& q, size_t threads) const {
    const DriveModel model = model_.with_values(space_.values(q));
    std::vector<Eigen::VectorXd> of_runs(runs_.size());
    parallel_for(runs_.size(), threads, [&](size_t run) { of_runs[run] = misfit(model, run); });
    Eigen::Index rows = q.size();
    for (const Eigen::VectorXd& one : of_runs)
      rows += one.size();
    Eigen::VectorXd all(rows);
    all.head(q.size()) = (q - start_).cwiseQuotient(spread_);
    Eigen::Index row = q.size();
    for (const Eigen::VectorXd& one : of_runs) {
      all.segment(row, one.size()) = one;
      row += one.size();
    }
    return all;
  }
  /// Over the errors; zero where nothing was measured.
  [[nodiscard]] Eigen::VectorXd misfit(const DriveModel& model, size_t run) const {
    const MeasuredCurve& seen = runs_[run].cavity_mL;
    const Eigen::Index count = seen.curve.harmonics();
    const PeriodicCurve shown = model.response(runs_[run].drive_mL, count).cavity_mL;
    Eigen::VectorXd rows = Eigen::VectorXd::Zero(2 * count + 1);
    for (Eigen::Index k = 0; k <= count; ++k) {
      const double error =
          std::hypot(seen.sigma[k], range_part * range_mL_, harmonic_part * std::abs(seen.curve.c[k]));
      const std::complex<double> off = std::isfinite(error) ? (seen.curve.c[k] - shown.c[k]) / error : 0.0;
      if (k > 0) rows.segment(2 * k - 1, 2) << off.real(), off.imag();
      if (k == 0 && run == 0) rows[0] = off.real();
    }
    return rows;
  }

  const DriveModel& model_;
  std::span<const GatedRun> runs_;
  double range_mL_;
  inference::ParameterSpace space_;
  std::vector<const Effect*> effect_of_;  ///< of each value
  Eigen::VectorXd start_, spread_;
};

}  // namespace

DriveModel fitted_model(const DriveModel& model, const std::vector<GatedRun>& runs, double range_mL) {
  if (runs.empty() || model.effects().empty()) return model;
  inference::SearchOptions options{.iteration_limit = 25};
  options.small_gain = [](double chi_square) { return std::max(0.05, 1e-3 * chi_square); };
  std::optional<Eigen::VectorXd> best;
  for (size_t count = 1; count <= runs.size(); ++count) {  // each run goes on from where the ones before led
    std::vector<GatedRun> from_rest(runs.begin(), runs.begin() + static_cast<std::ptrdiff_t>(count));
    const DriveModel so_far = best ? model.with_values(space_of(model).values(*best)) : model;
    for (GatedRun& run : from_rest)
      run.drive_mL = drive_from_rest(so_far, run, &run == &from_rest.front());
    ModelFit problem(model, from_rest, range_mL);
    double least = std::numeric_limits<double>::infinity();
    const auto search_from = [&](const Eigen::VectorXd& start) {
      const inference::SearchResult found = inference::minimise(problem, start, options);
      if (found.residuals.size() == 0 || found.cost() >= least) return;
      least = found.cost();
      best = found.q;
    };
    if (best) search_from(*best);
    if (2.0 * least < problem.measured()) continue;  // the runs before led here
    // From every start: a fit within the errors may have the wrong effects, and another start lead to a far better one.
    for (const Eigen::VectorXd& start : problem.nearest_starts())
      search_from(start);
  }
  return best ? model.with_values(space_of(model).values(*best)) : model;
}

}  // namespace diastole::shaping
