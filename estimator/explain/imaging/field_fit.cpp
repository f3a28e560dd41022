#include "estimator/explain/imaging/field_fit.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

#include "estimator/inference/covariance.hpp"
#include "estimator/inference/least_squares.hpp"
#include "estimator/mesh/node_field.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How far apart the models for a derivative lie, on each side.
double perturbation_of(const EffectParameter& parameter) {
  if (parameter.scale == SearchScale::logarithmic) return 1e-3;
  return std::max(1e-3 * std::abs(parameter.typical), 1e-7);
}

/// start + sum of shares * fields.
NodeField combined(NodeField start, const std::vector<double>& shares, const std::vector<NodeField>& fields) {
  for (size_t n = 0; n < shares.size(); ++n)
    add_scaled(start, shares[n], fields[n]);
  return start;
}

}  // namespace

/// A size of zero is the base model itself, which has no derivative towards the effect: fits stay a little off it.
inference::Parameter searched(const EffectParameter& parameter) {
  return {.name = std::string(parameter.name),
          .unit = std::string(parameter.unit),
          .lower = parameter.lower == 0.0 ? 1e-4 * parameter.typical : parameter.lower,
          .upper = parameter.upper,
          .scale = static_cast<inference::Scale>(parameter.scale)};
}

const EffectParameter& FieldChoice::parameter(size_t value) const {
  for (const Effect* effect : effects) {
    const auto parameters = effect->field_parameters();
    if (value < parameters.size()) return parameters[value];
    value -= parameters.size();
  }
  throw std::out_of_range("the choice has fewer values");
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

VectorXd FieldFit::all_residuals() const {
  VectorXd all(residuals.size() + priors.size());
  all << residuals, priors;
  return all;
}

void estimate_covariance(FieldFit& fit, const inference::ParameterSpace& space,
                         const std::vector<bool>& is_free) {
  const inference::Covariance found = inference::estimate_covariance(fit.jacobian, is_free);
  fit.covariance = found.matrix;
  fit.undetermined.clear();
  for (const VectorXd& combination : found.undetermined)
    fit.undetermined.push_back(inference::in_words(combination, space));
}

/// The search for one choice.
class FieldProblem::Search final : public inference::LeastSquaresProblem {
 public:
  Search(FieldProblem& problem, FieldChoice choice) : problem_(problem), choice_(std::move(choice)) {
    const auto& [lowest_kPa, highest_kPa] = problem.field_.C1_bounds_kPa;
    std::vector<inference::Parameter> unknowns{{.name = "C1_kPa",
                                                .lower = lowest_kPa,
                                                .upper = highest_kPa,
                                                .scale = inference::Scale::logarithmic}};
    for (const size_t value : choice_.free)
      unknowns.push_back(searched(choice_.parameter(value)));
    unknowns.resize(unknowns.size() + problem.rows_.frames().size(), {.name = "pressure_kPa"});
    space_ = inference::ParameterSpace(std::move(unknowns));
  }

  [[nodiscard]] VectorXd coordinates(const Start& start) const {
    std::vector<double> values{start.C1_kPa};
    for (const size_t value : choice_.free)
      values.push_back(choice_.values[value]);
    values.insert(values.end(), start.pressures_kPa.begin(), start.pressures_kPa.end());
    return space_.coordinates(values);
  }

  /// The fit there, without its numbers.
  [[nodiscard]] FieldFit at(const VectorXd& q) const {
    const std::vector<double> values = space_.values(q);
    FieldFit fit;
    fit.choice = choice_;
    fit.law = {values.front()};
    for (size_t i = 0; i < choice_.free.size(); ++i)
      fit.choice.values[choice_.free[i]] = values[1 + i];
    fit.pressures_kPa.assign(values.begin() + pressures(), values.end());
    return fit;
  }

  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  [[nodiscard]] std::string failure() const override { return "the specimen has no equilibrium there"; }
  std::optional<VectorXd> residuals(const VectorXd& q) override {
    if (problem_.field_.alive) problem_.field_.alive();
    FieldFit here = at(q);
    FieldSolver& solver = problem_.solver_;
    MotionResiduals& rows = problem_.rows_;
    solver.set(problem_.model_of(here.choice), here.C1_kPa());
    std::vector<NodeField> displacements_mm;
    for (size_t node = 0; node < problem_.nodes_kPa_.size(); ++node) {
      if (!solver.solve(node, problem_.nodes_kPa_[node])) return {};
      displacements_mm.push_back(solver.seen_displacement_mm(node));
    }
    std::vector<NodeField> seen_mm;
    for (const double pressure_kPa : here.pressures_kPa)
      seen_mm.push_back(combined(solver.mesh().reference(), problem_.shares(pressure_kPa), displacements_mm));
    if (rows.size() == 0) {
      (void)rows.find(solver.mesh(), solver.reference(), seen_mm);
    } else if (!rows.follow(solver.mesh(), solver.reference(), seen_mm, Following::closely)) {
      return {};
    }
    here.residuals = rows.residuals();
    here.priors = priors(here);
    return here.all_residuals();
  }
  MatrixXd jacobian(const VectorXd& q) override {
    const FieldFit here = at(q);
    FieldSolver& solver = problem_.solver_;
    const MotionResiduals& rows = problem_.rows_;
    const std::vector<FieldPerturbation> changes = perturbations(here);
    // Of the nodes' displacements: by C1, by the parameters, and the displacements themselves, which a pressure changes;
    // and of the undeformed mesh.
    std::vector<std::vector<NodeField>> by(2 + changes.size());
    for (size_t node = 0; node < problem_.nodes_kPa_.size(); ++node) {
      FieldSolver::Slopes slopes = solver.slopes(node, changes);
      by[0].push_back(std::move(slopes.modulus));
      for (size_t i = 0; i < changes.size(); ++i)
        by[1 + i].push_back(std::move(slopes.model[i]));
      by.back().push_back(solver.seen_displacement_mm(node));
    }
    std::vector<NodeField> mesh_slopes(by.size());
    for (size_t i = 0; i < changes.size(); ++i)
      mesh_slopes[1 + i] = solver.reference_slope(changes[i]);
    const NodeField still(solver.mesh().reference().size(), 0.0);
    const VectorXd priors_here = priors(here);
    MatrixXd result = MatrixXd::Zero(rows.size() + priors_here.size(), space_.size());
    for (size_t slot = 0; slot < here.pressures_kPa.size(); ++slot) {
      constexpr double step_kPa = 1e-4;
      const std::vector<double> shares = problem_.shares(here.pressures_kPa[slot]);
      std::vector<double> rise = problem_.shares(here.pressures_kPa[slot] + step_kPa);
      const std::vector<double> below = problem_.shares(here.pressures_kPa[slot] - step_kPa);
      for (size_t node = 0; node < rise.size(); ++node)
        rise[node] = (rise[node] - below[node]) / (2.0 * step_kPa);
      std::vector<NodeField> fields;
      for (size_t k = 0; k < by.size(); ++k)
        fields.push_back(combined(mesh_slopes[k].empty() ? still : mesh_slopes[k],
                                  k + 1 == by.size() ? rise : shares, by[k]));
      std::vector<const NodeField*> motion;
      std::vector<const NodeField*> reference;
      for (size_t k = 0; k < by.size(); ++k) {
        motion.push_back(&fields[k]);
        reference.push_back(mesh_slopes[k].empty() ? nullptr : &mesh_slopes[k]);
      }
      const MatrixXd block = rows.columns(slot, solver.mesh(), motion, reference);
      auto here_rows = result.middleRows(rows.first(slot), rows.count(slot));
      here_rows.leftCols(pressures()) = block.leftCols(pressures());
      here_rows.col(0) *= here.C1_kPa();
      here_rows.col(pressures() + static_cast<Index>(slot)) = block.rightCols<1>();
    }
    for (Index j = 0; j < q.size(); ++j) {
      constexpr double h = 1e-6;
      const VectorXd step = h * VectorXd::Unit(q.size(), j);
      result.col(j).tail(priors_here.size()) = (priors(at(q + step)) - priors(at(q - step))) / (2.0 * h);
    }
    return result;
  }

 private:
  /// Place of the first.
  [[nodiscard]] Index pressures() const { return 1 + static_cast<Index>(choice_.free.size()); }
  [[nodiscard]] VectorXd priors(const FieldFit& at) const {
    const FieldCase& field = problem_.field_;
    std::vector<double> values;
    for (size_t slot = 0; slot < at.pressures_kPa.size(); ++slot) {
      const Frame& frame = field.measurement.frames[static_cast<size_t>(problem_.rows_.frames()[slot])];
      values.push_back((at.pressures_kPa[slot] - frame.pressure_kPa) / std::max(frame.sigma_kPa, 1e-5));
    }
    if (field.C1_start_kPa.sigma > 0.0)
      values.push_back((at.C1_kPa() - field.C1_start_kPa.value) / field.C1_start_kPa.sigma);
    if (field.inner_radius_mm)
      values.push_back((problem_.model_of(at.choice).inner_radius_mm - field.inner_radius_mm->value) /
                       field.inner_radius_mm->sigma);
    return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
  }
  /// Of the model by each free parameter.
  [[nodiscard]] std::vector<FieldPerturbation> perturbations(const FieldFit& at) const {
    std::vector<FieldPerturbation> result;
    for (const size_t i : choice_.free) {
      const inference::Parameter parameter = searched(choice_.parameter(i));
      const double h = perturbation_of(choice_.parameter(i));
      const auto model = [&](double change) {
        FieldChoice changed = at.choice;
        changed.values[i] = parameter.value(parameter.coordinate(changed.values[i]) + change);
        return problem_.model_of(changed);
      };
      result.push_back({model(h), model(-h), 2.0 * h});
    }
    return result;
  }

  FieldProblem& problem_;
  FieldChoice choice_;
  inference::ParameterSpace space_;
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

double FieldProblem::volume_change_mL(const FieldFit& fit) {
  solver_.set(model_of(fit.choice), fit.C1_kPa());
  if (!solver_.solve(highest_node(), nodes_kPa_.back())) return std::nan("");
  const ElasticModel& model = solver_.elastic();
  return model.cavity_volume_mL(solver_.state(highest_node())) - model.cavity_volume_mL(model.rest_state());
}

FieldFit FieldProblem::fit(FieldChoice choice, const Start& start, std::optional<int> iteration_limit) {
  Search search(*this, std::move(choice));
  inference::SearchResult found =
      inference::minimise(search, search.coordinates(start),
                          {.iteration_limit = iteration_limit.value_or(field_.iteration_limit),
                           .small_gain = [](double) { return worth_a_step; }});
  FieldFit result = search.at(found.q);
  result.termination = found.termination;
  result.chi_square = HUGE_VAL;
  if (found.residuals.size() == 0) return result;
  // The rows and the solver end where the result does.
  const VectorXd all = search.residuals(found.q).value_or(found.residuals);
  result.chi_square = all.squaredNorm();
  result.residuals = all.head(rows_.size());
  result.priors = all.tail(all.size() - rows_.size());
  result.jacobian = std::move(found.jacobian);
  estimate_covariance(result, search.space(), search.space().free_unknowns(found.q));
  return result;
}

}  // namespace diastole::explain
