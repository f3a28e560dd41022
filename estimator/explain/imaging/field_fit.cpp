#include "estimator/explain/imaging/field_fit.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

namespace diastole::explain {
namespace {

using Eigen::Index;

bool logarithmic(const EffectParameter& parameter) { return parameter.scale == SearchScale::logarithmic; }

/// A size of zero is the base model itself, which has no derivative towards the effect: fits stay a little off it.
double least(const EffectParameter& parameter) {
  return parameter.lower == 0.0 ? 1e-4 * parameter.typical : parameter.lower;
}

double nudge_of(const EffectParameter& parameter) {
  if (logarithmic(parameter)) return 1e-3;
  return std::max(1e-3 * std::abs(parameter.typical), 1e-7);
}

}  // namespace

double to_coordinate(const EffectParameter& parameter, double value) {
  return logarithmic(parameter) ? std::log(value) : value;
}
double from_coordinate(const EffectParameter& parameter, double coordinate) {
  return logarithmic(parameter) ? std::exp(coordinate) : coordinate;
}

const EffectParameter& FieldChoice::parameter(size_t value) const {
  for (const Effect* effect : effects) {
    const auto parameters = effect->field_parameters();
    if (value < parameters.size()) return parameters[value];
    value -= parameters.size();
  }
  throw std::out_of_range("the choice has fewer values");
}

size_t FieldChoice::first_of(const Effect& wanted) const {
  size_t first = 0;
  for (const Effect* effect : effects) {
    if (effect == &wanted) break;
    first += effect->field_parameters().size();
  }
  return first;
}

void FieldChoice::apply_to(FieldModel& model) const {
  std::span<const double> left(values);
  for (const Effect* effect : effects) {
    const size_t count = effect->field_parameters().size();
    effect->apply_to_field(left.first(count), model);
    left = left.subspan(count);
  }
}

FieldChoice together(const FieldChoice& a, const FieldChoice& b) {
  FieldChoice both = a;
  both.effects.insert(both.effects.end(), b.effects.begin(), b.effects.end());
  both.values.insert(both.values.end(), b.values.begin(), b.values.end());
  for (const size_t value : b.free)
    both.free.push_back(a.values.size() + value);
  return both;
}

struct FieldProblem::Point {
  double log_C1 = 0.0;
  FieldChoice choice;
  std::vector<double> pressures_kPa;
  double cost = 0.0;
  Eigen::VectorXd residuals;
  Eigen::VectorXd priors;
  Eigen::MatrixXd jacobian;

  [[nodiscard]] size_t unknowns() const { return 1 + choice.free.size() + pressures_kPa.size(); }

  [[nodiscard]] Point moved(const Eigen::VectorXd& step, const std::array<double, 2>& C1_bounds_kPa) const {
    Point next = *this;
    next.log_C1 = std::clamp(log_C1 + step[0], std::log(C1_bounds_kPa[0]), std::log(C1_bounds_kPa[1]));
    Index at = 1;
    for (const size_t i : choice.free) {
      const EffectParameter& parameter = choice.parameter(i);
      const double value =
          from_coordinate(parameter, to_coordinate(parameter, choice.values[i]) + step[at++]);
      next.choice.values[i] = std::clamp(value, least(parameter), parameter.upper);
    }
    for (double& pressure_kPa : next.pressures_kPa)
      pressure_kPa += step[at++];
    return next;
  }
};

FieldProblem::FieldProblem(const FieldCase& field, std::array<size_t, 3> elements)
    : field_(field),
      solver_(elements, field.locator),
      rows_(field.measurement, loaded_frames(field.measurement), field.locator) {
  const std::vector<double> pressures_kPa = start().pressures_kPa;
  const double highest_kPa = std::ranges::max(pressures_kPa);
  nodes_kPa_ = {highest_kPa};
  if (pressures_kPa.size() > 1) nodes_kPa_ = {0.4 * highest_kPa, 0.72 * highest_kPa, highest_kPa};
}

std::vector<double> FieldProblem::shares(double pressure_kPa) const {
  std::vector<double> result;
  for (const double node_kPa : nodes_kPa_) {
    result.push_back(pressure_kPa / node_kPa);
    for (const double other_kPa : nodes_kPa_)
      if (other_kPa != node_kPa) result.back() *= (pressure_kPa - other_kPa) / (node_kPa - other_kPa);
  }
  return result;
}

namespace {

/// start + sum of shares * fields.
NodeField combined(NodeField start, const std::vector<double>& shares, const std::vector<NodeField>& fields) {
  for (size_t n = 0; n < shares.size(); ++n)
    for (size_t i = 0; i < start.size(); ++i)
      start[i] += shares[n] * fields[n][i];
  return start;
}

}  // namespace

FieldModel FieldProblem::model_of(const FieldChoice& choice) const {
  FieldModel model = field_.base;
  choice.apply_to(model);
  return model;
}

FieldProblem::Start FieldProblem::start() const {
  Start start{field_.C1_start_kPa.value, {}};
  for (const int frame : rows_.frames())
    start.pressures_kPa.push_back(field_.measurement.frames[static_cast<size_t>(frame)].pressure_kPa);
  return start;
}

Eigen::VectorXd FieldProblem::priors(const Point& at) const {
  std::vector<double> values;
  for (size_t slot = 0; slot < at.pressures_kPa.size(); ++slot) {
    const Frame& frame = field_.measurement.frames[static_cast<size_t>(rows_.frames()[slot])];
    values.push_back((at.pressures_kPa[slot] - frame.pressure_kPa) / std::max(frame.sigma_kPa, 1e-5));
  }
  if (field_.C1_start_kPa.sigma > 0.0)
    values.push_back((std::exp(at.log_C1) - field_.C1_start_kPa.value) / field_.C1_start_kPa.sigma);
  if (field_.inner_radius_mm)
    values.push_back((model_of(at.choice).inner_radius_mm - field_.inner_radius_mm->value) /
                     field_.inner_radius_mm->sigma);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
}

bool FieldProblem::evaluate(Point& at) {
  if (field_.alive) field_.alive();
  solver_.set(model_of(at.choice), std::exp(at.log_C1));
  std::vector<NodeField> displacements_mm;
  for (size_t node = 0; node < nodes_kPa_.size(); ++node) {
    if (!solver_.solve(node, nodes_kPa_[node])) return false;
    displacements_mm.push_back(solver_.seen_displacement_mm(node));
  }
  std::vector<NodeField> seen_mm;
  for (const double pressure_kPa : at.pressures_kPa)
    seen_mm.push_back(combined(solver_.mesh().reference(), shares(pressure_kPa), displacements_mm));
  if (rows_.size() == 0)
    (void)rows_.find(solver_.mesh(), solver_.reference(), seen_mm);
  else if (!rows_.follow(solver_.mesh(), solver_.reference(), seen_mm, Following::closely))
    return false;
  at.residuals = rows_.residuals();
  at.priors = priors(at);
  at.cost = at.residuals.squaredNorm() + at.priors.squaredNorm();
  return true;
}

void FieldProblem::differentiate(Point& at) {
  const auto unknowns = static_cast<Index>(at.unknowns());
  at.jacobian.setZero(rows_.size() + at.priors.size(), unknowns);
  std::vector<FieldNudge> nudges;
  for (const size_t i : at.choice.free) {
    const EffectParameter& parameter = at.choice.parameter(i);
    const double h = nudge_of(parameter);
    FieldChoice up = at.choice;
    FieldChoice down = at.choice;
    const double coordinate = to_coordinate(parameter, at.choice.values[i]);
    up.values[i] = from_coordinate(parameter, coordinate + h);
    down.values[i] = from_coordinate(parameter, coordinate - h);
    nudges.push_back({model_of(up), model_of(down), 2.0 * h});
  }
  // Of the nodes' displacements: by C1, by the nudged parameters, and the displacements themselves.
  std::vector<std::vector<NodeField>> by(2 + nudges.size());
  for (size_t node = 0; node < nodes_kPa_.size(); ++node) {
    FieldSolver::Slopes slopes = solver_.slopes(node, nudges);
    by[0].push_back(std::move(slopes.modulus));
    for (size_t i = 0; i < nudges.size(); ++i)
      by[1 + i].push_back(std::move(slopes.model[i]));
    by.back().push_back(solver_.seen_displacement_mm(node));
  }
  std::vector<NodeField> mesh_slopes{{}};
  for (const FieldNudge& nudge : nudges)
    mesh_slopes.push_back(solver_.reference_slope(nudge));
  mesh_slopes.emplace_back();
  const NodeField still(solver_.mesh().reference().size(), 0.0);
  const Index pressures = 1 + static_cast<Index>(nudges.size());
  for (size_t slot = 0; slot < at.pressures_kPa.size(); ++slot) {
    constexpr double step_kPa = 1e-4;
    std::vector<double> rise = shares(at.pressures_kPa[slot] + step_kPa);
    const std::vector<double> below = shares(at.pressures_kPa[slot] - step_kPa);
    for (size_t node = 0; node < rise.size(); ++node)
      rise[node] = (rise[node] - below[node]) / (2.0 * step_kPa);
    const std::vector<double> here = shares(at.pressures_kPa[slot]);
    std::vector<NodeField> fields;
    for (size_t k = 0; k < by.size(); ++k)
      fields.push_back(
          combined(mesh_slopes[k].empty() ? still : mesh_slopes[k], k + 1 == by.size() ? rise : here, by[k]));
    std::vector<const NodeField*> motion;
    std::vector<const NodeField*> reference;
    for (size_t k = 0; k < by.size(); ++k) {
      motion.push_back(&fields[k]);
      reference.push_back(mesh_slopes[k].empty() ? nullptr : &mesh_slopes[k]);
    }
    const Eigen::MatrixXd block = rows_.columns(slot, solver_.mesh(), motion, reference);
    at.jacobian.block(rows_.first(slot), 0, block.rows(), pressures) = block.leftCols(pressures);
    at.jacobian.block(rows_.first(slot), 0, block.rows(), 1) *= std::exp(at.log_C1);
    at.jacobian.block(rows_.first(slot), pressures + static_cast<Index>(slot), block.rows(), 1) =
        block.rightCols<1>();
  }
  for (Index j = 0; j < unknowns; ++j) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(unknowns);
    step[j] = 1e-6;
    Point up = at.moved(step, {0.0, HUGE_VAL});
    Point down = at.moved(-step, {0.0, HUGE_VAL});
    at.jacobian.col(j).tail(at.priors.size()) = (priors(up) - priors(down)) / 2e-6;
  }
}

double FieldProblem::taken_mL(const FieldFit& fit) {
  solver_.set(model_of(fit.choice), fit.C1_kPa);
  if (!solver_.solve(highest_node(), nodes_kPa_.back())) return std::nan("");
  const ElasticModel& model = solver_.elastic();
  return model.cavity_volume_mL(solver_.state(highest_node())) - model.cavity_volume_mL(model.rest_state());
}

FieldFit FieldProblem::fit(FieldChoice choice, const Start& start, const Options& options) {
  Point best{std::log(start.C1_kPa), std::move(choice), start.pressures_kPa, 0.0, {}, {}, {}};
  FieldFit result;
  if (!evaluate(best)) {
    result.choice = best.choice;
    result.chi_square = HUGE_VAL;
    return result;
  }
  double damping = 1e-4;
  bool current = false;
  for (int iteration = 0; iteration < options.iteration_limit && !result.converged; ++iteration) {
    if (!current) differentiate(best);
    current = true;
    Eigen::VectorXd all(best.residuals.size() + best.priors.size());
    all << best.residuals, best.priors;
    Eigen::MatrixXd normal = best.jacobian.transpose() * best.jacobian;
    const Eigen::VectorXd gradient = best.jacobian.transpose() * all;
    normal.diagonal() *= 1.0 + damping;
    const Eigen::VectorXd step = -normal.ldlt().solve(gradient);
    Point trial = best.moved(step, field_.C1_bounds_kPa);
    const double expected = -gradient.dot(step);
    if (evaluate(trial) && trial.cost < best.cost) {
      result.converged = best.cost - trial.cost < options.tolerance;
      best = std::move(trial);
      damping = std::max(1e-7, 0.1 * damping);
      current = false;
    } else {
      result.converged = expected < options.tolerance;
      damping *= 20.0;
      if (damping > 1e6) break;
    }
  }
  // The rows and the solver end where the result does.
  Point end = best;
  (void)evaluate(end);
  differentiate(end);
  result.choice = end.choice;
  result.C1_kPa = std::exp(end.log_C1);
  result.pressures_kPa = end.pressures_kPa;
  result.chi_square = end.cost;
  result.covariance = (end.jacobian.transpose() * end.jacobian).inverse();
  result.residuals = std::move(end.residuals);
  result.jacobian = std::move(end.jacobian);
  result.priors = std::move(end.priors);
  return result;
}

}  // namespace diastole::explain
