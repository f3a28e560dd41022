#include "estimator/explain/rig/screen.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/parallel/parallel_for.hpp"
#include "estimator/rig_fit/change_point_search.hpp"
#include "estimator/rig_fit/linear_basis.hpp"

namespace diastole::explain {
namespace {

constexpr size_t further_columns = 2;  // by an effect's other parameters, at most

/// Parts of the typical size at which an effect is tried: one where the answer is nearly proportional to it, more where
/// resonances move.
std::vector<double> trial_sizes(const Effect& effect) {
  const bool resonant = effect.text().port == Port::drive && effect.text().synergies.size() > 0;
  if (resonant || effect.parameters()[0].scale != SearchScale::linear) return {0.2, 0.7, 1.5};
  return {0.5};
}

bool contains(const std::vector<rig::ModelTerm>& terms, const Effect* effect) {
  return std::any_of(terms.begin(), terms.end(),
                     [&](const rig::ModelTerm& term) { return term.effect == effect; });
}

/// The effect's values with the first parameter at `size` of the way from neutral to typical.
std::vector<double> values_at(const Effect& effect, const rig::RigModel& base, double size) {
  std::vector<double> values;
  for (const EffectParameter& parameter : effect.parameters())
    values.push_back(parameter.typical);
  const EffectParameter& first = effect.parameters()[0];
  values[0] = std::clamp(rig::sized_value(first, effect.neutral(base)[0], size), first.lower, first.upper);
  return values;
}

/// Another value of a further parameter: neutral if that is another, else some way towards the farther bound.
double varied(const EffectParameter& parameter) {
  if (parameter.neutral != parameter.typical) return parameter.neutral;
  const auto at = [&](double value) { return inference::to_coordinate(parameter.scale, value); };
  const double typical = at(parameter.typical);
  const double up = at(parameter.upper) - typical, down = at(parameter.lower) - typical;
  return inference::from_coordinate(parameter.scale,
                                    typical + 0.3 * (std::abs(up) > std::abs(down) ? up : down));
}

/// Sizes beyond those of `trial_sizes` up to the bound, for what moves a resonance.
std::vector<double> far_sizes(const Effect& effect, const rig::RigModel& base) {
  constexpr double ratio = 1.3;
  const EffectParameter& parameter = effect.parameters()[0];
  if (parameter.scale != SearchScale::inverse_square) return {};
  const auto at = [&](double value) { return inference::to_coordinate(parameter.scale, value); };
  const double from = at(effect.neutral(base)[0]);
  const double towards = at(parameter.typical);
  const double bound = at(towards > from ? parameter.lower : parameter.upper);
  std::vector<double> sizes;
  for (double size = ratio * trial_sizes(effect).back(); size < (bound - from) / (towards - from);
       size *= ratio)
    sizes.push_back(size);
  return sizes;
}

void set_change_points(Lead& lead, size_t points, const Eigen::VectorXd& left, const rig::RigFit& current,
                       const Eigen::VectorXd& weights) {
  lead.parameters = lead.term.effect->parameters().size() + change_point_parameters * points;
  lead.gain = weights.dot(current.residuals.cwiseAbs2() - left.cwiseAbs2());
  lead.visibility = std::sqrt(std::max(lead.gain, 0.0));
}

}  // namespace

void search_change_points(Lead& lead, const rig::RigProblem& problem, const rig::Session& session,
                          const rig::RigFit& current, const Eigen::VectorXd& weights) {
  if (lead.term.effect->change_points() == ChangePoints::none || lead.fit) return;
  auto found = rig::find_change_points(problem, session, current, *lead.term.effect);
  if (!found) {
    lead.gain = 0.0;
    return;
  }
  lead.term = std::move(found->term);
  set_change_points(lead, lead.term.change_points.size(), found->fit.residuals, current, weights);
  lead.fit = std::move(found->fit);
}

double linear_gain(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns,
                   const Eigen::VectorXd& residuals) {
  Eigen::MatrixXd free = columns;
  for (int again = 0; again < 2; ++again)
    free -= basis * (basis.transpose() * free);
  for (Eigen::Index c = 0; c < free.cols(); ++c)
    if (free.col(c).norm() < rig::dependent * columns.col(c).norm()) free.col(c).setZero();
  return (rig::basis_of(free).transpose() * residuals).squaredNorm();
}

namespace {

/// One screening of a set; `lead_of` may be called by several threads at once.
class Screening {
 public:
  Screening(const rig::RigProblem& problem, const rig::Session& session, const rig::RigFit& current,
            const Eigen::VectorXd& weights)
      : problem_(problem),
        session_(session),
        current_(current),
        weights_(weights),
        root_(weights.cwiseSqrt()),
        residuals_(root_.asDiagonal() * current.residuals),
        without_(problem.residuals(current, rig::for_differences)),
        known_(rig::basis_of(root_.asDiagonal() * current.jacobian)) {}

  [[nodiscard]] std::optional<Lead> lead_of(const Effect& effect) const {
    return effect.change_points() == ChangePoints::none ? lead_by_size(effect)
                                                        : lead_by_change_points(effect);
  }

 private:
  [[nodiscard]] Eigen::VectorXd change_by(const Effect& effect, const std::vector<double>& values) const {
    rig::KnownModel more = current_;
    more.terms.push_back({&effect, {}});
    more.values.insert(more.values.end(), values.begin(), values.end());
    return root_.asDiagonal() * (problem_.residuals(more, rig::for_differences) - without_);
  }
  [[nodiscard]] Eigen::VectorXd beyond_known(const Eigen::VectorXd& change) const {
    return change - known_ * (known_.transpose() * change);
  }
  [[nodiscard]] std::optional<Lead> lead_by_change_points(const Effect& effect) const {
    const auto promised = rig::promise_change_points(problem_, session_, current_, effect);
    if (!promised) return {};
    Lead lead{{&effect, {}}};
    set_change_points(lead, promised->count, promised->residuals, current_, weights_);
    return lead;
  }
  [[nodiscard]] Lead lead_by_size(const Effect& effect) const {
    const auto parameters = effect.parameters();
    Lead lead{{&effect, {}}, 0.0, 0.0, parameters.size(), {}};
    for (const double size : trial_sizes(effect)) {
      const std::vector<double> values = values_at(effect, session_.base, size);
      const size_t count = std::min(parameters.size(), further_columns + 1);
      Eigen::MatrixXd columns(residuals_.size(), static_cast<Eigen::Index>(count));
      for (size_t j = 0; j < count; ++j) {
        std::vector<double> other = values;
        if (j > 0) other[j] = varied(parameters[j]);
        columns.col(static_cast<Eigen::Index>(j)) = change_by(effect, other);
      }
      lead.gain = std::max(lead.gain, linear_gain(known_, columns, residuals_));
      lead.visibility = std::max(lead.visibility, beyond_known(columns.col(0)).norm() / size);
    }
    for (const double size : far_sizes(effect, session_.base)) {
      const Eigen::VectorXd left =
          beyond_known(residuals_ + change_by(effect, values_at(effect, session_.base, size)));
      lead.gain = std::max(lead.gain, residuals_.squaredNorm() - left.squaredNorm());
    }
    return lead;
  }

  const rig::RigProblem& problem_;
  const rig::Session& session_;
  const rig::RigFit& current_;
  const Eigen::VectorXd& weights_;
  const Eigen::VectorXd root_, residuals_;
  const Eigen::VectorXd without_;  ///< any of the effects; not weighted
  const Eigen::MatrixXd known_;
};

}  // namespace

std::vector<Lead> screen(const rig::RigProblem& problem, const rig::SpecimenFamily& family,
                         const rig::Session& session, const rig::RigFit& current,
                         const Eigen::VectorXd& weights, const std::function<void()>& going_on) {
  const Screening screening(problem, session, current, weights);
  std::vector<const Effect*> tried;
  for (const Effect* effect : all_effects())
    if (!contains(current.terms, effect) && effect->fits(family)) tried.push_back(effect);
  std::vector<std::optional<Lead>> found(tried.size());
  parallel_for(tried.size(), problem.threads(), [&](size_t i) {
    going_on();
    found[i] = screening.lead_of(*tried[i]);
  });
  std::vector<Lead> leads;
  for (std::optional<Lead>& lead : found)
    if (lead) leads.push_back(std::move(*lead));
  std::sort(leads.begin(), leads.end(), [](const Lead& a, const Lead& b) { return a.gain > b.gain; });
  return leads;
}

}  // namespace diastole::explain
