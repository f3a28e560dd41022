#include "estimator/explain/screen.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/rig_fit/moment_search.hpp"
#include "estimator/rig_fit/search_scale.hpp"

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

bool contains(const std::vector<rig::Ingredient>& ingredients, const Effect* effect) {
  return std::any_of(ingredients.begin(), ingredients.end(),
                     [&](const rig::Ingredient& ingredient) { return ingredient.effect == effect; });
}

/// The effect's values with the first parameter at `size` of the way from neutral to typical.
std::vector<double> values_at(const Effect& effect, const rig::RigModel& base, double size) {
  std::vector<double> values = effect.neutral(base);
  for (size_t j = 0; j < values.size(); ++j) {
    const EffectParameter& parameter = effect.parameters()[j];
    if (j > 0) {
      values[j] = parameter.typical;
      continue;
    }
    const double from = rig::to_search(parameter.scale, values[j]);
    const double towards = rig::to_search(parameter.scale, parameter.typical);
    values[j] = std::clamp(rig::from_search(parameter.scale, from + size * (towards - from)), parameter.lower,
                           parameter.upper);
  }
  return values;
}

/// Another value of a further parameter: neutral if that is another, else some way towards the farther bound.
double varied(const EffectParameter& parameter) {
  if (parameter.neutral != parameter.typical) return parameter.neutral;
  const double at = rig::to_search(parameter.scale, parameter.typical);
  const double a = rig::to_search(parameter.scale, parameter.lower);
  const double b = rig::to_search(parameter.scale, parameter.upper);
  return rig::from_search(parameter.scale, at + 0.3 * ((std::abs(b - at) > std::abs(a - at) ? b : a) - at));
}

/// Sizes beyond those of `trial_sizes` up to the bound, for what moves a resonance.
std::vector<double> far_sizes(const Effect& effect, const rig::RigModel& base) {
  constexpr double ratio = 1.3;
  const EffectParameter& parameter = effect.parameters()[0];
  if (parameter.scale != SearchScale::inverse_square) return {};
  const double from = rig::to_search(parameter.scale, effect.neutral(base)[0]);
  const double towards = rig::to_search(parameter.scale, parameter.typical);
  const double bound = rig::to_search(parameter.scale, towards > from ? parameter.lower : parameter.upper);
  std::vector<double> sizes;
  for (double size = ratio * trial_sizes(effect).back(); size < (bound - from) / (towards - from);
       size *= ratio)
    sizes.push_back(size);
  return sizes;
}

void set_moments(Lead& lead, size_t moments, const Eigen::VectorXd& left, const rig::RigFit& current,
                 const Eigen::VectorXd& weights) {
  lead.parameters = lead.ingredient.effect->parameters().size() + moment_parameters * moments;
  lead.gain = weights.dot(current.residuals.cwiseAbs2() - left.cwiseAbs2());
  lead.visibility = std::sqrt(std::max(lead.gain, 0.0));
}

}  // namespace

void search_moments(Lead& lead, const rig::RigProblem& problem, const rig::Session& session,
                    const rig::RigFit& current, const Eigen::VectorXd& weights) {
  if (lead.ingredient.effect->occasions() == Occasions::none || lead.fit) return;
  auto found = rig::find_moments(problem, session, current, *lead.ingredient.effect);
  if (!found) {
    lead.gain = 0.0;
    return;
  }
  lead.ingredient = std::move(found->ingredient);
  set_moments(lead, lead.ingredient.occasions.size(), found->fit.residuals, current, weights);
  lead.fit = std::move(found->fit);
}

Eigen::MatrixXd basis_of(const Eigen::MatrixXd& columns) {
  constexpr double dependent = 1e-6;
  Eigen::MatrixXd basis(columns.rows(), columns.cols());
  Eigen::Index count = 0;
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    Eigen::VectorXd column = columns.col(c);
    const double size = column.norm();
    if (!(size > 0.0) || !std::isfinite(size)) continue;
    for (int again = 0; again < 2; ++again)
      column -= basis.leftCols(count) * (basis.leftCols(count).transpose() * column);
    if (column.norm() < dependent * size) continue;
    basis.col(count++) = column.normalized();
  }
  return basis.leftCols(count);
}

double linear_gain(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns,
                   const Eigen::VectorXd& residuals) {
  Eigen::MatrixXd both(columns.rows(), basis.cols() + columns.cols());
  both << basis, columns;
  const Eigen::MatrixXd reached = basis_of(both);
  return (reached.rightCols(reached.cols() - basis.cols()).transpose() * residuals).squaredNorm();
}

std::vector<Lead> screen(const rig::RigProblem& problem, const rig::SpecimenFamily& family,
                         const rig::Session& session, const rig::RigFit& current,
                         const Eigen::VectorXd& weights, const std::function<void()>& going_on) {
  const Eigen::VectorXd root = weights.cwiseSqrt();
  const Eigen::VectorXd residuals = root.asDiagonal() * current.residuals;
  const Eigen::MatrixXd known = basis_of(root.asDiagonal() * current.jacobian);
  const auto change_by = [&](const Effect* effect, const std::vector<double>& values) -> Eigen::VectorXd {
    going_on();
    std::vector<rig::Ingredient> ingredients = current.ingredients;
    ingredients.push_back({effect, {}});
    std::vector<double> all = current.values;
    all.insert(all.end(), values.begin(), values.end());
    return root.asDiagonal() * (problem.residuals(ingredients, all) - current.residuals);
  };
  std::vector<Lead> leads;
  for (const Effect* effect : all_effects()) {
    if (contains(current.ingredients, effect) || !effect->fits(family)) continue;
    if (effect->occasions() != Occasions::none) {
      going_on();
      const auto promised = rig::promise_moments(problem, session, current, *effect);
      if (!promised) continue;
      leads.push_back({{effect, {}}});
      set_moments(leads.back(), promised->count, promised->residuals, current, weights);
      continue;
    }
    const auto parameters = effect->parameters();
    Lead lead{{effect, {}}, 0.0, 0.0, parameters.size(), {}};
    for (const double size : trial_sizes(*effect)) {
      const std::vector<double> values = values_at(*effect, session.base, size);
      Eigen::MatrixXd columns(residuals.size(), 0);
      const auto add_column = [&](const std::vector<double>& at) {
        columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
        columns.rightCols(1) = change_by(effect, at);
      };
      add_column(values);
      for (size_t j = 1; j < std::min(parameters.size(), further_columns + 1); ++j) {
        std::vector<double> other = values;
        other[j] = varied(parameters[j]);
        add_column(other);
      }
      lead.gain = std::max(lead.gain, linear_gain(known, columns, residuals));
      const Eigen::VectorXd seen = columns.col(0) - known * (known.transpose() * columns.col(0));
      lead.visibility = std::max(lead.visibility, seen.norm() / size);
    }
    for (const double size : far_sizes(*effect, session.base)) {
      const Eigen::VectorXd there = residuals + change_by(effect, values_at(*effect, session.base, size));
      const Eigen::VectorXd left = there - known * (known.transpose() * there);
      lead.gain = std::max(lead.gain, residuals.squaredNorm() - left.squaredNorm());
    }
    leads.push_back(lead);
  }
  std::sort(leads.begin(), leads.end(), [](const Lead& a, const Lead& b) { return a.gain > b.gain; });
  return leads;
}

}  // namespace diastole::explain
