#include "estimator/explain/rig/learned_term.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/explain/rig/findings.hpp"
#include "estimator/explain/rig/frozen_leak.hpp"
#include "estimator/explain/rig/held_out.hpp"
#include "estimator/explain/rig/law_fit.hpp"
#include "estimator/explain/rig/law_readings.hpp"
#include "estimator/explain/verdict/learned_file.hpp"
#include "estimator/inference/information.hpp"
#include "estimator/inference/intervals.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::Termination;
using rig::SessionModel;

constexpr double false_proposals = 0.01;  ///< of sessions in which nothing is missing, at most
constexpr size_t laws_refined = most_learned_laws;
constexpr double worth_refining = 0.5;  ///< of the best law's gain
constexpr double least_closed = 0.5;
constexpr double as_good = 3.0;  ///< nats: one in twenty

/// A law as a candidate: its knots and what its curve's values do.
struct LawCandidate {
  const PortLaw* law;
  std::vector<double> knots;
  double scale;
  CurvePrior prior;
  LawProblem problem;
  LawFit fit;
  SessionModel at;                                     ///< where the problem is linearised, without the law
  VectorXd values;                                     ///< of the curve there
  double gain = 0.0;                                   ///< nats, of all data
  std::vector<double> gains;                           ///< of each fold
  Termination termination = Termination::no_solution;  ///< of the search for its curve, and of all its fits
};

/// From where a law is linearised towards its fit, halved until the simulated features are better than they were.
struct LawStep {
  SessionModel at;
  VectorXd values;
  bool is_better = false;
  /// Mean square, over the error's variance, of what is left there less what the linear model leaves at its fit.
  double bent = 0.0;
};

using Progress = std::function<void(std::string_view)>;

class LawSearch {
 public:
  LawSearch(const rig::SessionProblem& problem, const EffectSet& set, const Progress& progress,
            int most_rounds)
      : problem_(problem),
        set_(set),
        progress_(progress),
        most_rounds_(most_rounds),
        ranges_(variable_ranges(problem, set.model)) {}

  std::vector<LawCandidate> run(const std::vector<Fold>& folds);
  [[nodiscard]] const rig::EvidenceFit& without() const { return without_; }
  /// Values at all knots.
  [[nodiscard]] static std::vector<double> at_knots(const LawCandidate& law, const VectorXd& free);
  [[nodiscard]] VectorXd shown_with(const LawCandidate& law, const SessionModel& at,
                                    const VectorXd& free) const {
    return features_with(law, at, {free}).col(1);
  }

 private:
  [[nodiscard]] Index nuisances() const { return set_.model.nuisances.size(); }
  /// Whoever listens may end the search by what it throws.
  void report(const std::string& what = {}) const {
    if (progress_) progress_(what);
  }
  [[nodiscard]] double gain_of(const LawCandidate& law) const {
    return law.fit.evidence.log_evidence - without_.log_evidence;
  }
  /// Features of a model and of the same with curves of these values.
  [[nodiscard]] MatrixXd features_with(const LawCandidate& law, const SessionModel& at,
                                       const std::vector<VectorXd>& curves) const;
  void linearise(LawCandidate& law, const SessionModel& at, const VectorXd& values,
                 const MatrixXd& known) const;
  [[nodiscard]] LawStep step_of(const LawCandidate& law) const;
  /// Columns of the other unknowns there: anew if they are far from where they were.
  [[nodiscard]] MatrixXd known_after(const LawCandidate& law, const LawStep& step) const;
  /// Gauss-Newton, until the linear model predicts what its own step shows. Interrupted where the law falls behind one that gains this much.
  [[nodiscard]] Termination refine(LawCandidate& law, double best_gain) const;
  void judge(LawCandidate& law, const std::vector<Fold>& folds) const;

  const rig::SessionProblem& problem_;
  const EffectSet& set_;
  const Progress& progress_;
  int most_rounds_;
  VariableRanges ranges_;
  LawProblem base_;  ///< without a law
  rig::EvidenceFit without_;
};

std::vector<double> LawSearch::at_knots(const LawCandidate& law, const VectorXd& free) {
  std::vector<double> values(law.knots.size(), 0.0);
  for (size_t i = 0; i < law.prior.free_knots().size(); ++i)
    values[law.prior.free_knots()[i]] = free[static_cast<Index>(i)];
  return values;
}

MatrixXd LawSearch::features_with(const LawCandidate& law, const SessionModel& at,
                                  const std::vector<VectorXd>& curves) const {
  std::vector<std::shared_ptr<const Effect>> effects;
  std::vector<SessionModel> models{at};
  // About no leak, a small one need not be solved for.
  const bool is_frozen = law.law->sets == "q_hose" && curves.size() > 1 && curves.front().isZero();
  const auto frozen = is_frozen ? std::optional<FrozenLeak>(std::in_place, problem_, at) : std::nullopt;
  for (const VectorXd& curve : curves) {
    const std::vector<double> values = at_knots(law, curve);
    effects.push_back(is_frozen ? frozen->of(law.knots, values)
                                : effect_of_text(tabulated_law(*law.law, law.knots, values)));
    models.push_back(at);
    models.back().terms.push_back({effects.back().get(), {}});
    models.back().values.push_back(1.0);
  }
  if (law.law->port == Port::sensor)
    return problem_.predicted_features(models, std::vector<bool>(models.size(), true));
  // Not all at once: a leak that is solved for takes long, and Ctrl-C is seen in between.
  constexpr size_t at_once = 2;
  MatrixXd all(problem_.features().count(), static_cast<Index>(models.size()));
  for (size_t first = 0; first < models.size(); first += at_once) {
    const std::span some = std::span(models).subspan(first, std::min(at_once, models.size() - first));
    all.middleCols(static_cast<Index>(first), static_cast<Index>(some.size())) =
        problem_.predicted_features(some);
    report();
  }
  return all;
}

void LawSearch::linearise(LawCandidate& law, const SessionModel& at, const VectorXd& values,
                          const MatrixXd& known) const {
  constexpr double small_part = 0.01;  // of the scale: far above what simulations copy
  // Increments where the law is made of such: what falls with the distance is hard to solve for.
  MatrixXd moves = law.prior.increments();
  if (moves.cols() == 0) moves = MatrixXd::Identity(values.size(), values.size());
  std::vector<VectorXd> curves{values};
  for (Index k = 0; k < values.size(); ++k)
    curves.push_back(values + small_part * law.scale * moves.col(k));
  const MatrixXd all = features_with(law, at, curves);
  law.at = at;
  law.values = values;
  law.problem.known = known;
  law.problem.responses =
      (all.rightCols(values.size()).colwise() - all.col(1)) / (small_part * law.scale) * moves.inverse();
  law.problem.target = problem_.measured() - all.col(1) + law.problem.responses * values +
                       known.rightCols(nuisances()) * at.nuisances;
}

LawStep LawSearch::step_of(const LawCandidate& law) const {
  constexpr double least_modulus = 0.2;  // times what it was, in a step
  const VectorXd weight = law.fit.evidence.variance.cwiseInverse();
  const auto cost = [&](const VectorXd& left, const VectorXd& u) {
    return left.cwiseAbs2().dot(weight) + u.squaredNorm();
  };
  const auto linear_left = [&](const VectorXd& values, const VectorXd& u) -> VectorXd {
    return law.problem.target - law.problem.responses * values - law.problem.known.rightCols(nuisances()) * u;
  };
  LawStep step{.at = law.at, .values = law.fit.values};
  const VectorXd u = law.fit.evidence.estimate.tail(nuisances());
  step.at.nuisances = u;
  // Pressures are in proportion to the modulus, whose logarithm u[0] is.
  const double sd = problem_.nuisances().front().sd;
  step.at.nuisances[0] =
      law.at.nuisances[0] + std::log(std::max(1.0 + sd * (u[0] - law.at.nuisances[0]), least_modulus)) / sd;
  const VectorXd linear = linear_left(step.values, u);
  const double before = cost(linear_left(law.values, law.at.nuisances), law.at.nuisances);
  for (int halving = 0; halving < 4 && !step.is_better; ++halving) {
    if (halving > 0) {
      step.at.nuisances = 0.5 * (step.at.nuisances + law.at.nuisances);
      step.values = 0.5 * (step.values + law.values);
    }
    const VectorXd left = problem_.measured() - shown_with(law, step.at, step.values);
    step.is_better = left.allFinite() && cost(left, step.at.nuisances) < before;
    step.bent = (left - linear).cwiseAbs2().cwiseProduct(weight).mean();
  }
  return step;
}

MatrixXd LawSearch::known_after(const LawCandidate& law, const LawStep& step) const {
  constexpr double far = 1.0;  // sds of nuisances
  MatrixXd known = law.problem.known;
  if ((step.at.nuisances - law.at.nuisances).norm() <= far) return known;
  SessionModel with = step.at;
  const auto effect = effect_of_text(tabulated_law(*law.law, law.knots, at_knots(law, step.values)));
  with.terms.push_back({effect.get(), {}});
  with.values.push_back(1.0);
  VectorXd there;
  known.rightCols(nuisances()) = problem_.nuisance_columns(with, there);
  return known;
}

Termination LawSearch::refine(LawCandidate& law, double best_gain) const {
  constexpr double straight = 0.1;  // of the error's variance, in the mean
  for (int round = 0;; ++round) {
    report(fmt::format("learning {} by {}, round {}", law.law->sets, law.law->of, round + 1));
    const LawStep step = step_of(law);
    if (step.bent < straight) return Termination::converged;
    if (!step.is_better) return Termination::stalled;
    if (round == most_rounds_) return Termination::iteration_limit;
    const LawCandidate last = law;
    linearise(law, step.at, step.values, known_after(law, step));
    if (!law.problem.responses.allFinite()) {
      law = last;
      return Termination::stalled;
    }
    law.fit = fit_law(law.problem, problem_.error(), law.prior, law.fit);
    if (gain_of(law) < worth_refining * best_gain) return Termination::interrupted;
  }
}

void LawSearch::judge(LawCandidate& law, const std::vector<Fold>& folds) const {
  for (const Fold& fold : folds) {
    const std::vector<Index> fitted = fold.others();
    const rig::ModelError error = error_of_rows(problem_.error(), fitted);
    const LawProblem base = base_.rows(fitted);
    const rig::EvidenceFit plain = fit_with_shares(base.target, base.known, error, without_.shares);
    report();
    const LawFit with = fit_law(law.problem.rows(fitted), error, law.prior, law.fit);
    MatrixXd columns(law.problem.known.rows(), with.root.cols() + law.problem.known.cols());
    columns << law.problem.responses * with.root, law.problem.known;
    law.termination = inference::of_both(law.termination, plain.termination);
    law.termination = inference::of_both(law.termination, with.evidence.termination);
    law.gains.push_back(
        held_out_density({law.problem.target, columns}, problem_.error(), fitted, with.evidence.shares) -
        held_out_density({base_.target, base_.known}, problem_.error(), fitted, plain.shares));
  }
}

std::vector<LawCandidate> LawSearch::run(const std::vector<Fold>& folds) {
  base_.known = set_.columns;
  base_.target = problem_.measured() - problem_.predicted_features(std::span(&set_.model, 1)) +
                 base_.known.rightCols(nuisances()) * set_.model.nuisances;
  without_ = fit_with_shares(base_.target, base_.known, problem_.error(), set_.evidence.shares);
  std::vector<LawCandidate> laws;
  for (const PortLaw& law : port_laws()) {
    if (!is_seen(law, problem_)) continue;
    report();
    const std::vector<double> knots = curve_knots(ranges_.at(law.of));
    const double scale = curve_scale(law, problem_, ranges_);
    LawCandidate& made = laws.emplace_back(
        LawCandidate{&law, knots, scale, CurvePrior(law.shape, knots, scale), {}, {}, {}, {}, 0.0, {}});
    linearise(made, set_.model, VectorXd::Zero(static_cast<Index>(made.prior.free_knots().size())),
              base_.known);
    made.fit.evidence.shares = without_.shares;
    made.fit = fit_law(made.problem, problem_.error(), made.prior, made.fit);
    made.gain = gain_of(made);
  }
  std::ranges::sort(laws, std::greater(), &LawCandidate::gain);
  const double least = std::max(std::log(1.0 / false_proposals), worth_refining * laws.front().gain);
  std::erase_if(laws, [&](const LawCandidate& law) { return law.gain < least; });
  if (laws.size() > laws_refined) laws.erase(laws.begin() + laws_refined, laws.end());
  double best_gain = 0.0;
  for (LawCandidate& law : laws) {
    law.termination = inference::of_both(refine(law, best_gain), without_.termination);
    law.termination = inference::of_both(law.termination, law.fit.evidence.termination);
    best_gain = std::max(best_gain, gain_of(law));
    judge(law, folds);
    law.gain = 0.0;
    for (const double gain : law.gains)
      law.gain += gain;
  }
  std::ranges::sort(laws, std::greater(), &LawCandidate::gain);
  return laws;
}

bool predicts_better(const std::vector<double>& gains, size_t laws) {
  const auto better = std::ranges::count_if(gains, [](double gain) { return gain > 0.0; });
  return 2 * static_cast<size_t>(better) > gains.size() &&
         log_mean(gains) > std::log(static_cast<double>(laws) / false_proposals);
}

/// The set with the law's curve as linear unknowns.
EffectSet set_with(const EffectSet& set, const LawCandidate& law) {
  EffectSet with = set;
  with.evidence = law.fit.evidence;
  with.model.nuisances = law.fit.evidence.estimate.tail(set.model.nuisances.size());
  with.columns.resize(law.problem.known.rows(), law.fit.root.cols() + law.problem.known.cols());
  with.columns << law.problem.responses * law.fit.root, law.problem.known;
  with.known.columns = law.problem.known.rightCols(set.model.nuisances.size());
  with.covariance = inference::covariance_of_information(law.fit.evidence.precision).matrix;
  return with;
}

CurveEvidence evidence_of(const LawCandidate& law) {
  const VectorXd weight = law.fit.evidence.variance.cwiseInverse();
  const MatrixXd& known = law.problem.known;
  MatrixXd normal = known.transpose() * weight.asDiagonal() * known;
  normal.diagonal().array() += 1.0;
  const MatrixXd weighted = weight.asDiagonal() * law.problem.responses;
  const MatrixXd beyond =
      weighted - weight.asDiagonal() * known * normal.llt().solve(known.transpose() * weighted);
  const std::vector<size_t>& free = law.prior.free_knots();
  const auto knots = static_cast<Index>(law.knots.size());
  CurveEvidence evidence{MatrixXd::Zero(knots, knots), VectorXd::Zero(knots)};
  evidence.precision(free, free) = law.problem.responses.transpose() * beyond;
  evidence.slope(free) = beyond.transpose() * law.problem.target;
  return evidence;
}

/// One of laws that predict as well as each other: its curve with the band, and its file.
LearnedTerm read_term(const rig::SessionProblem& problem, const std::vector<const LawCandidate*>& equals,
                      size_t which) {
  const LawCandidate& law = *equals[which];
  LearnedTerm term;
  term.port = name_of(law.law->port);
  term.sets = law.law->sets;
  term.variables = law.law->variables;
  term.variable_unit = law.law->of_unit;
  term.unit = law.law->unit;
  const std::vector<double> values = LawSearch::at_knots(law, law.fit.values);
  const std::vector<double> sds = LawSearch::at_knots(law, law.fit.sd);
  for (size_t k = 0; k < law.knots.size(); ++k) {
    const double half = inference::normal_90 * sds[k];
    term.curve.push_back({law.knots[k], values[k]});
    term.band.push_back({values[k] - half, values[k] + half});
    if (law.law->shape != CurveShape::passive && law.law->shape != CurveShape::resisting) continue;
    auto& [lower, upper] = term.band.back();
    (law.knots[k] < 0.0 ? upper : lower) = law.knots[k] < 0.0 ? std::min(upper, 0.0) : std::max(lower, 0.0);
  }
  LawText text{.id = learned_id(which)};
  for (const rig::SessionRun& run : problem.session().runs)
    if (!run.run_id.empty()) text.learnt_from.push_back(run.run_id);
  for (size_t i = 0; i < equals.size(); ++i)
    if (i != which) text.looks_alike.push_back(learned_id(i));
  read_law(*law.law, evidence_of(law), term, std::move(text));
  return term;
}

/// What is missing for the best law to be proposed; empty: nothing.
std::string reason_rejected(const LawCandidate& law, const ChangeSize& size, const Gap& gap,
                            const ErrorKnowledge& known) {
  if (!inference::is_settled(law.termination)) {
    std::string_view why = inference::sentence(law.termination);
    why.remove_suffix(1);  // the full stop
    return fmt::format("is not fitted to its end: its search did not settle. {}", why);
  }
  if (!predicts_better(law.gains, port_laws().size()))
    return "does not predict waveforms better that it was not fitted to, beyond what chance does";
  if (size.is_tolerance) return "changes no more than the rig's tolerances may";
  if (size.over_error < known.least_size())
    return fmt::format("changes {:.2g} times the model's own error; {:.2g} make a finding", size.over_error,
                       known.least_size());
  if (gap.closed < least_closed)
    return fmt::format(
        "closes {:.0f} % of the gap on waveforms that it was not fitted to; {:.0f} % are asked",
        100.0 * gap.closed, 100.0 * least_closed);
  return {};
}

}  // namespace

Learning learn_term(const rig::SessionProblem& problem, const EffectSet& set, const ErrorKnowledge& known,
                    const std::function<void(std::string_view)>& progress, int most_rounds) {
  const std::vector<Fold> folds = folds_of(problem);
  if (folds.size() < 2) return {{}, "there is one waveform only, and no other to judge a law on"};
  if (progress) progress("learning what no known effect explains");
  LawSearch search(problem, set, progress, most_rounds);
  const std::vector<LawCandidate> laws = search.run(folds);
  if (laws.empty())
    return {{}, "with none of the laws at a port are these recordings a hundred times as likely"};
  const LawCandidate& best = laws.front();
  const EffectSet with = set_with(set, best);
  const VectorXd none = VectorXd::Zero(best.values.size());
  const ChangeSize size = size_of_change(
      problem, with,
      search.shown_with(best, with.model, best.fit.values) - search.shown_with(best, with.model, none));
  EffectSet before = set;
  before.evidence = search.without();
  EffectSet stated = with;
  stated.evidence.variance = problem.error().variance(problem.error().prior.share);
  const Gap gap = held_out_gap(problem, before, stated);
  if (const std::string lacks = reason_rejected(best, size, gap, known); !lacks.empty())
    return {{}, fmt::format("the best, {} by {}, {}", best.law->sets, best.law->of, lacks)};
  std::vector<const LawCandidate*> equals;
  for (const LawCandidate& law : laws)
    if (&law == &best || (law.gain > best.gain - as_good && inference::is_settled(law.termination)))
      equals.push_back(&law);
  LearnedTerm term = read_term(problem, equals, 0);
  for (size_t i = 1; i < equals.size(); ++i) {
    LearnedTerm other = read_term(problem, equals, i);
    term.rivals.push_back({other.port, other.sets, other.variables, {}, std::move(other.toml)});
  }
  term.gap = gap;
  term.held_out_gain = log_mean(best.gains);
  term.shifts = parameter_shifts(problem, before, with);
  return {std::move(term), {}};
}

}  // namespace diastole::explain
