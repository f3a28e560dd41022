#include "estimator/explain/imaging/specimen_problem.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/fit/considered_errors.hpp"
#include "estimator/fit/finer_mesh.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/fit/usable_points.hpp"
#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/least_squares.hpp"
#include "estimator/inference/linear_model.hpp"
#include "estimator/model/affected_model.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int iteration_limit = 60;  // of a fit: an inclusion's size and contrast trade off along a ridge

std::vector<double> free_values(const FieldChoice& choice) {
  std::vector<double> values;
  for (const size_t value : choice.free)
    values.push_back(choice.values[value]);
  return values;
}

std::vector<double> values_of(const FieldFit& fit) {
  std::vector<double> values = fit.law;
  const std::vector<double> free = free_values(fit.choice);
  values.insert(values.end(), free.begin(), free.end());
  return values;
}

}  // namespace

SpecimenProblem::SpecimenProblem(const Study& study, std::function<void(const std::string&)> report)
    : report_(std::move(report)),
      study_(study),
      specimen_(study),
      estimated_(estimated_parameters(study, specimen_.with({}))) {
  field_.base = field_change_of(study);
  field_.locator = locator_for(study.specimen);
  field_.measurement = read_measurement(study);
  require_loaded_points(study, field_.measurement);
  if (std::ranges::none_of(loaded_frames(field_.measurement), [&](int frame) {
        return field_.measurement.frames[static_cast<size_t>(frame)].pressure_kPa > 0.0;
      }))
    throw InputError({study.file.string(), "data.frames", "no frame with points is inflated",
                      "Give the frames' cavity pressures in kPa, at least one of them above 0."});
  // A pressure that is exactly known is one that is known very well: every frame has its unknown.
  constexpr double exact_kPa = 1e-5;
  for (Frame& frame : field_.measurement.frames)
    frame.sigma_kPa = std::max(frame.sigma_kPa, exact_kPa);
}

void SpecimenProblem::refuse_base(const std::string& reason) const {
  throw InputError({study_.file.string(), "law.parameters", "the base model has no equilibrium: " + reason,
                    "Start from stiffer values, or check the frames' pressures; `diastole fit` says more."});
}

void SpecimenProblem::fit_base() {
  rows_.reset();
  base_motion_.reset();
  correction_.resize(0);
  base_ = {};
  tolerances_.resize(0, 0);
  FitOptions options;
  options.file = study_.file.string();
  options.locator = field_.locator;
  options.on_step = [this](const inference::SearchStep&) { report_(""); };
  ChangedMotion motion(changes_of({}, specimen_), estimated_.groups, {});
  std::vector<std::string> remarks;
  const FitOutcome outcome =
      fit_from_current_values(motion, estimated_, field_.measurement, options, remarks);
  if (outcome.history.empty() || outcome.frames.empty()) refuse_base(outcome.reason);
  for (const std::string& remark : remarks)
    report_(remark);
  if (outcome.robust) loss_ = outcome.robust->loss;
  for (const EstimatedValue& value : outcome.values)
    base_.law.push_back(value.value);
  for (const EstimatedFrame& frame : outcome.frames)
    base_.pressures_kPa.push_back(frame.pressure_kPa);
  base_ = fit({}, base_);
  if (!rows_) refuse_base("nowhere near the first fit's values.");
  find_tolerances();
  correct_mesh();
}

void SpecimenProblem::find_tolerances() {
  // Of surfaces through guide points, and of fibre fields from diffusion: what `lv` and `fibres` reach.
  constexpr double geometry_mm = 0.25;
  constexpr double fibres_deg = 2.0;
  ElasticModel body = specimen_.with(field_.base);
  std::vector<ConsideredError> errors;
  const auto add = [&](std::vector<ConsideredError> more) {
    std::ranges::move(more, std::back_inserter(errors));
  };
  if (study_.fibres && body.law().needs_axes()) add(fibre_errors(body, fibres_deg));
  if (std::holds_alternative<MeshSpecimen>(study_.specimen) && !study_.chamber)
    add(geometry_errors(body, geometry_mm));
  if (errors.empty()) return;
  MatrixXd columns(rows_->size(), static_cast<Index>(errors.size()));
  for (size_t slot = 0; slot < base_.pressures_kPa.size(); ++slot) {
    report_("");
    const ChangedMotion::Equilibrium at = base_motion_->equilibrium(slot);
    const std::vector<ConsideredMotion> motions = considered_motions(at.body, at.state, errors);
    std::vector<const NodeField*> motion, reference;
    for (const ConsideredMotion& one : motions) {
      motion.push_back(&one.by_motion);
      reference.push_back(&one.by_reference);
    }
    columns.middleRows(rows_->first(slot), rows_->count(slot)) =
        rows_->columns(slot, mesh(), motion, reference);
  }
  tolerances_ = std::move(columns);
  base_ = fit({}, base_);
}

size_t SpecimenProblem::highest_slot() const {
  return static_cast<size_t>(std::ranges::max_element(base_.pressures_kPa) - base_.pressures_kPa.begin());
}

double SpecimenProblem::law_error(const FieldFit& fit, size_t value) const {
  const EstimatedParameter& parameter = estimated_.values[value];
  const auto place = static_cast<Index>(value);
  return inference::standard_error(parameter, parameter.coordinate(fit.law[value]),
                                   std::sqrt(fit.covariance(place, place)));
}

BodyChanges SpecimenProblem::changes_of(const FieldChoice& choice, const ChangeableSpecimen& specimen) const {
  BodyChanges changes;
  changes.body = [&specimen](const FieldModel& change) { return specimen.with(change); };
  changes.change = [base = field_.base, choice](std::span<const double> unknown) {
    FieldChoice at = choice;
    for (size_t i = 0; i < unknown.size(); ++i)
      at.values[at.free[i]] = unknown[i];
    FieldModel model = base;
    at.apply_to(model);
    return model;
  };
  for (const size_t value : choice.free)
    changes.steps.push_back(step_of(choice.parameter(value)));
  return changes;
}

ChangedMotion SpecimenProblem::motion_of(const FieldChoice& choice) const {
  ChangedMotion motion(changes_of(choice, specimen_), estimated_.groups, free_values(choice));
  if (base_motion_) motion.begin_at(*base_motion_);
  return motion;
}

FieldFit SpecimenProblem::fit(const FieldChoice& choice, const FieldFit& from) {
  const bool is_base = choice.effects.empty();
  std::vector<EstimatedParameter> unknowns = estimated_.values;
  for (size_t i = 0; i < unknowns.size(); ++i)
    unknowns[i].start = std::clamp(from.law[i], unknowns[i].lower, unknowns[i].upper);
  for (const size_t value : choice.free) {
    const EffectParameter& parameter = choice.parameter(value);
    unknowns.emplace_back(std::clamp(choice.values[value], parameter.lower, parameter.upper), parameter.lower,
                          parameter.upper, std::string(parameter.name), std::string(parameter.unit));
  }
  auto motion = std::make_unique<ChangedMotion>(motion_of(choice));
  JointProblem problem(*motion, unknowns, field_.measurement, field_.locator);
  problem.set_robust(loss_);
  VectorXd start = problem.start();
  for (size_t slot = 0; slot < from.pressures_kPa.size(); ++slot)
    start[*problem.frames()[slot].pressure_unknown] = from.pressures_kPa[slot];
  FieldFit result;
  result.choice = choice;
  result.chi_square = HUGE_VAL;
  // The points are found where the base's first fit began, so that all fits have the same.
  if (!rows_) points_at_ = from;
  if (!problem.find_points(rows_ ? where_points_are(problem, choice) : start)) return result;
  if (rows_ && problem.motion_residuals().size() != rows_->size()) return result;
  problem.set_correction(correction_);
  inference::SearchOptions options;
  options.iteration_limit = iteration_limit;
  options.refusal_limit = 12;
  options.small_gain = [](double) { return worth_a_step; };
  options.on_step = [this](const inference::SearchStep&) { report_(""); };
  const inference::SearchResult found = inference::minimise(problem, start, options);
  if (found.residuals.size() == 0 || !problem.residuals(found.q)) return result;
  take(found, problem, result);
  if (!is_base) return result;
  std::vector<const MotionResiduals*> frames;
  for (const JointProblem::LoadedFrame& frame : problem.frames())
    frames.push_back(&frame.residuals);
  rows_ = MotionResiduals::joined(frames);
  base_motion_ = std::move(motion);
  return result;
}

VectorXd SpecimenProblem::where_points_are(const JointProblem& problem, const FieldChoice& choice) const {
  VectorXd q = problem.start();
  std::vector<double> values = points_at_.law;
  for (const size_t value : choice.free)
    values.push_back(choice.parameter(value).neutral);
  for (size_t i = 0; i < values.size(); ++i)
    q[static_cast<Index>(i)] = problem.space()[static_cast<Index>(i)].coordinate(values[i]);
  for (size_t slot = 0; slot < points_at_.pressures_kPa.size(); ++slot)
    q[*problem.frames()[slot].pressure_unknown] = points_at_.pressures_kPa[slot];
  return q;
}

std::optional<VectorXd> SpecimenProblem::correction_at(const FieldFit& fit) {
  if (!finer_) finer_.emplace(on_finer_mesh(study_));
  ChangedMotion own = motion_of(fit.choice);
  ChangedMotion finer(changes_of(fit.choice, *finer_), estimated_.groups, free_values(fit.choice));
  const std::vector<double> values = values_of(fit);
  std::vector<NodeField> position_mm;
  for (size_t slot = 0; slot < fit.pressures_kPa.size(); ++slot) {
    report_("");
    MotionOutcome outcome = own.solve(slot, values, fit.pressures_kPa[slot]);
    if (!outcome.position_mm) return {};
    position_mm.push_back(*std::move(outcome.position_mm));
  }
  return finer_mesh_correction(finer, {mesh(), position_mm, values, fit.pressures_kPa}, *rows_,
                               field_.locator);
}

void SpecimenProblem::correct_mesh() {
  std::optional<VectorXd> correction = correction_at(base_);
  if (!correction) return;
  correction_ = *std::move(correction);
  FieldFit corrected = fit({}, base_);
  if (!std::isfinite(corrected.chi_square)) {
    correction_.resize(0);
    return;
  }
  base_ = std::move(corrected);
  const MatrixXd column = error_left_on_finer_mesh * correction_;
  mesh_error_ = LinearEvidence(base_, column).size(0);
}

void SpecimenProblem::take(const inference::SearchResult& found, JointProblem& problem, FieldFit& fit) const {
  const Index unknowns = found.q.size(), own = found.residuals.size(), tolerances = tolerances_.cols();
  const Index rows = problem.motion_residuals().size();
  std::vector<bool> is_free(found.pressed);
  is_free.flip();
  is_free.resize(static_cast<size_t>(unknowns + tolerances), true);
  fit.termination = found.termination;
  fit.jacobian = MatrixXd::Zero(own + tolerances, unknowns + tolerances);
  fit.jacobian.topLeftCorner(own, unknowns) = problem.jacobian(found.q);
  std::vector<inference::Parameter> parameters(static_cast<size_t>(unknowns + tolerances),
                                               {.name = "tolerance"});
  for (Index i = 0; i < unknowns; ++i)
    parameters[static_cast<size_t>(i)] = problem.space()[i];
  const inference::ParameterSpace space(parameters);
  inference::LinearModel at{found.q, found.residuals, {}};
  at.q.conservativeResizeLike(VectorXd::Zero(unknowns + tolerances));
  at.residuals.conservativeResizeLike(VectorXd::Zero(own + tolerances));
  if (tolerances > 0) {
    fit.jacobian.topRightCorner(own, tolerances).topRows(rows) = tolerances_;
    fit.jacobian.bottomRightCorner(tolerances, tolerances).setIdentity();
    at.jacobian = fit.jacobian;
    move_to_minimum(at, space, is_free);
  }
  const VectorXd& residuals = at.residuals;
  const std::vector<double> values = space.values(at.q);
  const size_t law = estimated_.values.size();
  fit.law.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(law));
  for (size_t i = 0; i < fit.choice.free.size(); ++i) {
    const size_t value = fit.choice.free[i];
    fit.choice.values[value] = values[law + i];
    // Of the coordinate in which the parameter is reported.
    const auto column = static_cast<Index>(law + i);
    const bool by_logarithm = space[column].scale == inference::Scale::logarithmic;
    if (!by_logarithm || fit.choice.parameter(value).scale != SearchScale::linear) continue;
    fit.jacobian.col(column) /= values[law + i];
    parameters[law + i].scale = inference::Scale::linear;
  }
  fit.pressures_kPa.clear();
  for (const JointProblem::LoadedFrame& frame : problem.frames())
    fit.pressures_kPa.push_back(values[static_cast<size_t>(*frame.pressure_unknown)]);
  fit.residuals = residuals.head(rows);
  fit.priors = residuals.tail(residuals.size() - rows);
  fit.chi_square = residuals.squaredNorm();
  estimate_covariance(fit, inference::ParameterSpace(std::move(parameters)), space.free_unknowns(at.q));
}

MatrixXd SpecimenProblem::columns_of(const std::vector<ChangedMotion::Perturbation>& changes) {
  MatrixXd columns(rows_->size(), static_cast<Index>(changes.size()));
  for (size_t slot = 0; slot < base_.pressures_kPa.size(); ++slot) {
    report_("");
    const std::vector<NodeField> fields = base_motion_->by_changes(slot, changes);
    columns.middleRows(rows_->first(slot), rows_->count(slot)) =
        rows_->columns(slot, mesh(), pointers_to(fields));
  }
  return columns;
}

FieldFit SpecimenProblem::settled(const FieldFit& at) {
  if (correction_.size() == 0) return at;
  std::optional<VectorXd> correction = correction_at(at);
  if (!correction) return at;
  std::swap(correction_, *correction);
  FieldFit again = fit(at.choice, at);
  std::swap(correction_, *correction);
  return std::isfinite(again.chi_square) ? again : at;
}

std::vector<ParameterShift> SpecimenProblem::shifts(const FieldFit& after) const {
  std::vector<ParameterShift> result;
  for (size_t i = 0; i < estimated_.values.size(); ++i)
    result.push_back(
        {estimated_.values[i].name, base_.law[i], law_error(base_, i), after.law[i], law_error(after, i)});
  return result;
}

double SpecimenProblem::volume_change_mL(const FieldFit& fit) const {
  ChangedMotion motion = motion_of(fit.choice);
  const size_t slot = highest_slot();
  if (!motion.solve(slot, values_of(fit), fit.pressures_kPa[slot]).position_mm) return std::nan("");
  const ChangedMotion::Equilibrium at = motion.equilibrium(slot);
  if (!at.body.system().cavity_closed()) return std::nan("");
  return at.body.cavity_volume_mL(at.state) - at.body.cavity_volume_mL(at.body.rest_state());
}

}  // namespace diastole::explain
