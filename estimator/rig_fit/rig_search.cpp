#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/least_squares.hpp"
#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::rig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::ParameterSpace;

constexpr double small_gain = 0.01;  ///< of chi-square: not worth a step
constexpr double small_part = 1e-4;  ///< of what is above the noise: the same where a model is wrong

ParameterSpace space_of(const std::vector<Unknown>& unknowns) {
  return ParameterSpace({unknowns.begin(), unknowns.end()});
}

/// The unknowns of one model of the session.
class TermsProblem : public inference::LeastSquaresProblem {
 public:
  TermsProblem(const RigProblem& rig, const std::vector<ModelTerm>& terms, const FitRequest& request)
      : rig_(rig), terms_(terms), request_(request), space_(space_of(rig.unknowns(terms))) {}

  [[nodiscard]] const ParameterSpace& space() const override { return space_; }
  [[nodiscard]] inference::Linearisation linearisation() const override {
    return inference::Linearisation::kept;
  }
  std::optional<VectorXd> residuals(const VectorXd& q) override {
    VectorXd found = rig_.residuals({terms_, space_.values(q)}, request_);
    if (!found.allFinite()) return {};  // no motion at these values: the cavity is empty, say
    return found;
  }
  MatrixXd jacobian(const VectorXd& q) override { return rig_.columns({terms_, space_.values(q)}, request_); }

 private:
  const RigProblem& rig_;
  const std::vector<ModelTerm>& terms_;
  const FitRequest& request_;
  ParameterSpace space_;
};

/// The term's values at a size: amplitudes go from neutral (0) to typical (1) and beyond, the others are typical.
/// Empty if a bound is in the way.
std::vector<double> sized(const ModelTerm& term, const RigModel& base, double size) {
  const std::vector<double> neutral = term.effect->neutral(base);
  std::vector<double> values;
  for (size_t j = 0; j < neutral.size(); ++j) {
    const EffectParameter& parameter = term.effect->parameters()[j];
    const bool amplitude =
        j == 0 || (parameter.scale == SearchScale::linear && neutral[j] == 0.0 && parameter.lower == 0.0);
    values.push_back(amplitude ? sized_value(parameter, neutral[j], size) : parameter.typical);
    if (!(values.back() >= parameter.lower && values.back() <= parameter.upper)) return {};
  }
  return values;
}

}  // namespace

std::vector<KnownModel> RigProblem::starts(const std::vector<ModelTerm>& terms, const RigFit& before,
                                           size_t& simulations) const {
  constexpr double far_off = 4.0;     // coarse squares a row, when even the best start is not near
  constexpr double farthest = 120.0;  // typical sizes, if no bound is nearer
  const FitRequest coarse{.fidelity = Fidelity::coarse, .runs = {}};
  const MatrixXd known = columns(before, coarse);
  const Eigen::LDLT<MatrixXd> normal(
      MatrixXd(known.transpose() * known + 1e-9 * MatrixXd::Identity(known.cols(), known.cols())));
  simulations += static_cast<size_t>(known.cols());
  const ParameterSpace space = space_of(before.unknowns);
  std::vector<std::pair<double, std::vector<double>>> tried;
  const auto add = [&](double size) {
    std::vector<double> values = before.values;
    for (size_t i = before.terms.size(); i < terms.size(); ++i) {
      const std::vector<double> more = sized(terms[i], session_.base, size);
      if (more.empty()) return;
      values.insert(values.end(), more.begin(), more.end());
    }
    const VectorXd misfit = residuals({terms, values}, coarse);
    ++simulations;
    if (!misfit.allFinite()) return;
    // What was known before follows, as far as it is linear.
    const VectorXd shift = -normal.solve(known.transpose() * misfit);
    const std::vector<double> shifted = space.values(space.clamped(space.coordinates(before.values) + shift));
    std::copy(shifted.begin(), shifted.end(), values.begin());
    tried.emplace_back((misfit + known * shift).squaredNorm(), values);
  };
  for (const double size : {0.1, 0.3, 0.6, 1.0, 1.5, 2.5, 4.0, -0.3, -1.0})
    add(size);
  if (tried.empty() ||
      std::min_element(tried.begin(), tried.end())->first > far_off * static_cast<double>(rows_)) {
    for (const double size :
         {0.14, 0.2, 0.25, 0.36, 0.43, 0.51, 0.7, 0.8, 0.9, 1.12, 1.25, 1.37, 1.75, 2.1, 3.0, 3.5})
      add(size);
    const size_t within = tried.size();
    size_t far = 0;
    for (double size = 4.6; size < farthest && tried.size() == within + far; size *= 1.15, ++far)
      add(size);
  }
  if (tried.empty()) add(0.0);
  std::sort(tried.begin(), tried.end());
  std::vector<KnownModel> models;
  for (auto& [square, values] : tried)
    models.push_back({terms, std::move(values)});
  if (!models.empty()) return models;
  KnownModel neutral{terms, before.values};
  for (size_t i = before.terms.size(); i < terms.size(); ++i)
    std::ranges::copy(terms[i].effect->neutral(session_.base), std::back_inserter(neutral.values));
  return {neutral};
}

RigFit RigProblem::fit(const std::vector<ModelTerm>& terms, const RigFit& before) const {
  constexpr double near =
      1.5;  // coarse squares a row of the first search, beyond which other starts are tried
  constexpr size_t most_starts = 3;
  if (terms.size() == before.terms.size()) return fit_from({terms, before.values});
  size_t simulations = 0, iterations = 0;
  const std::vector<KnownModel> from = starts(terms, before, simulations);
  std::optional<RigFit> coarse;
  for (size_t start = 0; start < std::min(from.size(), most_starts); ++start) {
    RigFit found = fit_from(from[start], {.fidelity = Fidelity::coarse, .runs = {}});
    iterations += found.iterations;
    simulations += found.simulations;
    const bool is_near = found.chi_square <= near * static_cast<double>(rows_);
    if (!coarse || found.chi_square < coarse->chi_square) coarse = std::move(found);
    if (start == 0 && is_near) break;
  }
  RigFit fine = fit_from(*coarse);
  fine.iterations += iterations;
  fine.simulations += simulations;
  return fine;
}

RigFit RigProblem::fit_from(const KnownModel& start, const FitRequest& request) const {
  RigFit fit;
  fit.terms = start.terms;
  fit.unknowns = unknowns(start.terms);
  fit.count = count_rows(request);
  TermsProblem problem(*this, start.terms, request);
  inference::SearchOptions options;
  options.iteration_limit = options_.iteration_limit;
  options.small_gain = [&](double chi_square) {
    return small_gain + small_part * std::max(chi_square - static_cast<double>(fit.count), 0.0);
  };
  options.refusal_limit = 9;
  options.first_radius = 1e6;
  options.held.assign(fit.unknowns.size(), false);
  options.held[2] = !noise_.channels.contains(Channel::pump);
  inference::SearchResult found = minimise(problem, problem.space().coordinates(start.values), options);

  const auto of_plant = std::ranges::count(fit.unknowns, false, &Unknown::sensors_only);
  fit.termination = found.termination;
  fit.iterations = static_cast<size_t>(found.iterations);
  fit.simulations = static_cast<size_t>(found.evaluations + found.linearisations * (of_plant + 1));
  fit.values = problem.space().values(found.q);
  if (found.termination == inference::Termination::no_solution) {
    const auto rows = static_cast<Index>(rows_);
    found.residuals = VectorXd::Constant(rows, std::numeric_limits<double>::quiet_NaN());
    found.jacobian = MatrixXd::Zero(rows, found.q.size());
    found.pressed = options.held;
  }
  fit.residuals = std::move(found.residuals);
  fit.jacobian = std::move(found.jacobian);
  fit.chi_square = fit.residuals.squaredNorm();
  std::vector<bool> is_free;
  for (size_t i = 0; i < fit.values.size(); ++i)
    is_free.push_back(!found.pressed[i] && !options.held[i] &&
                      !fit.jacobian.col(static_cast<Index>(i)).isZero(0.0));
  const VectorXd variance = inference::estimate_covariance(fit.jacobian, is_free).matrix.diagonal();
  for (Index i = 0; i < found.q.size(); ++i)
    fit.errors.push_back(inference::standard_error(problem.space()[i], found.q[i], std::sqrt(variance[i])));
  return fit;
}

}  // namespace diastole::rig
