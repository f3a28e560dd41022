// Any specimen that `fit` takes, on the study's own mesh: its base model is the fit's (estimator/fit), and its effects are changes of
// the body or of what images show (changed_motion.hpp).
//
// Every effect is first judged by its linear response at the base, one back-substitution a parameter and frame; only what could be
// beyond chance is fitted with all else.

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/explain/imaging/imaged_specimen.hpp"
#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/explain/verdict/chi_square.hpp"
#include "estimator/fit/changed_motion.hpp"
#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/fit/finer_mesh.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/fit/usable_points.hpp"
#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/least_squares.hpp"
#include "estimator/io/study_refusal.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/changed_specimen.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double worth_a_step = 0.02;   // of chi2
constexpr double worth_freeing = 9.0;   // gain of chi2 by which further parameters of an effect must pay
constexpr double suspected = 1e-2;      // p-value of a linear gain: reason to fit the effect
constexpr double beyond_chance = 1e-3;  // of a place beside another effect
constexpr double effective_parameters = 5.0;  // of an inclusion: its sizes are tied to one another
constexpr int iteration_limit = 60;  // of a fit: an inclusion's size and contrast trade off along a ridge
constexpr size_t firsts = 2;         // single effects that get partners

double volume_mm3(const HermiteMesh& mesh) {
  double sum = 0.0;
  for (size_t e = 0; e < mesh.element_count(); ++e)
    for (const ReferencePoint& point : make_reference_element(mesh, e))
      sum += point.volume;
  return sum;
}

class AnySpecimen final : public ImagedSpecimen {
 public:
  AnySpecimen(const Study& study, const FieldProgress& progress)
      : progress_(progress),
        study_(study),
        specimen_(study),
        estimated_(estimated_parameters(study, specimen_.with({}))),
        effects_(specimen_.effects()),
        volume_mm3_(volume_mm3(specimen_.mesh())) {
    field_.base = field_change_of(study);
    field_.locator = locator_for(study.specimen);
    field_.measurement = read_measurement(study);
    require_loaded_points(study, field_.measurement);
    // A pressure that is exactly known is one that is known very well: every frame has its unknown.
    constexpr double exact_kPa = 1e-5;
    for (Frame& frame : field_.measurement.frames)
      frame.sigma_kPa = std::max(frame.sigma_kPa, exact_kPa);
  }

  void fit_base() override {
    rows_.reset();
    base_motion_.reset();
    correction_.resize(0);
    base_ = {};
    FitOptions options;
    options.file = study_.file.string();
    options.locator = field_.locator;
    options.on_step = [this](const inference::SearchStep&) { alive(); };
    ChangedMotion motion(changes_of({}, specimen_), estimated_.groups, {});
    const FitOutcome fit = fit_motion(motion, estimated_.values, field_.measurement, options);
    if (fit.history.empty() || fit.frames.empty())
      throw InputError(
          {options.file, "law.parameters", "the base model has no equilibrium: " + fit.reason,
           "Start from stiffer values, or check the frames' pressures; `diastole fit` says more."});
    if (fit.robust) loss_ = fit.robust->loss;
    for (const EstimatedValue& value : fit.values)
      base_.law.push_back(value.value);
    for (const EstimatedFrame& frame : fit.frames)
      base_.pressures_kPa.push_back(frame.pressure_kPa);
    base_ = search({}, base_);
    if (progress_) progress_("looking at what a finer mesh changes");
    correct_mesh();
  }

  void widen_sigmas(double factor) override { field_.widen_sigmas(factor); }

  [[nodiscard]] const FieldCase& field() const override { return field_; }
  [[nodiscard]] const MotionResiduals& rows() const override { return *rows_; }
  [[nodiscard]] const HermiteMesh& mesh() const override { return specimen_.mesh(); }
  [[nodiscard]] const FieldFit& base() const override { return base_; }
  [[nodiscard]] FieldModes modes() override {
    const ChangedMotion::Equilibrium at = base_motion_->equilibrium(highest_slot());
    return field_modes(*rows_, at.body, at.state, base_.pressures_kPa);
  }

  [[nodiscard]] std::vector<FieldHypothesis> singles(const FieldProgress& progress) override {
    std::vector<FieldHypothesis> tried = linear_gains();
    add_inclusion(tried);
    std::ranges::stable_sort(tried, std::greater{}, &FieldHypothesis::gain);
    for (FieldHypothesis& hypothesis : tried) {
      if (hypothesis.p_value > suspected) continue;
      if (progress) progress("fitting " + hypothesis.name());
      refit(hypothesis);
    }
    return tried;
  }

  [[nodiscard]] std::vector<FieldHypothesis> pairs(const std::vector<FieldHypothesis>& singles) override {
    std::vector<FieldHypothesis> found;
    const size_t begun = std::min(firsts, singles.size());
    for (size_t a = 0; a < begun; ++a) {
      if (!singles[a].refitted) continue;
      for (size_t b = 0; b < singles.size(); ++b) {
        if (b == a || (b < a && singles[b].refitted)) continue;
        if (progress_) progress_("fitting " + singles[a].name() + " + " + singles[b].name());
        if (std::optional<FieldHypothesis> pair = beside(singles[a], singles[b]))
          found.push_back(*std::move(pair));
      }
    }
    std::ranges::stable_sort(found, std::greater{}, &FieldHypothesis::score);
    return found;
  }

  [[nodiscard]] std::vector<ParameterShift> shifts(const FieldFit& after) const override {
    std::vector<ParameterShift> result;
    for (size_t i = 0; i < estimated_.values.size(); ++i)
      result.push_back(
          {estimated_.values[i].name, base_.law[i], law_error(base_, i), after.law[i], law_error(after, i)});
    return result;
  }

  void settle(FieldHypothesis& hypothesis) override {
    if (correction_.size() == 0) return;
    std::optional<VectorXd> correction = correction_at(hypothesis.fit);
    if (!correction) return;
    std::swap(correction_, *correction);
    FieldFit fit = search(hypothesis.fit.choice, hypothesis.fit);
    std::swap(correction_, *correction);
    if (std::isfinite(fit.chi_square)) hypothesis.fit = std::move(fit);
  }

  [[nodiscard]] double mesh_error() const override { return mesh_error_; }

  [[nodiscard]] double volume_change_mL(const FieldHypothesis& hypothesis) override {
    const FieldFit& fit = hypothesis.fit;
    ChangedMotion motion = motion_of(fit.choice);
    const size_t slot = highest_slot();
    if (!motion.solve(slot, values_of(fit), fit.pressures_kPa[slot]).position_mm) return std::nan("");
    const ChangedMotion::Equilibrium at = motion.equilibrium(slot);
    if (!at.body.system().cavity_closed()) return std::nan("");
    return at.body.cavity_volume_mL(at.state) - at.body.cavity_volume_mL(at.body.rest_state());
  }

 private:
  void alive() const {
    if (progress_) progress_("");
  }

  [[nodiscard]] size_t highest_slot() const {
    return static_cast<size_t>(std::ranges::max_element(base_.pressures_kPa) - base_.pressures_kPa.begin());
  }

  [[nodiscard]] double law_error(const FieldFit& fit, size_t value) const {
    const EstimatedParameter& law = estimated_.values[value];
    const inference::Parameter parameter{
        .name = law.name,
        .lower = law.lower,
        .upper = law.upper,
        .scale = law.lower > 0.0 ? inference::Scale::logarithmic : inference::Scale::linear};
    const auto place = static_cast<Index>(value);
    return inference::standard_error(parameter, parameter.coordinate(fit.law[value]),
                                     std::sqrt(fit.covariance(place, place)));
  }

  [[nodiscard]] BodyChanges changes_of(const FieldChoice& choice, const ChangeableSpecimen& specimen) const {
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
  /// Half the distance for differences.
  [[nodiscard]] static double step_of(const EffectParameter& parameter) {
    return 1e-3 * std::abs(parameter.typical);
  }

  [[nodiscard]] static std::vector<double> free_values(const FieldChoice& choice) {
    std::vector<double> values;
    for (const size_t value : choice.free)
      values.push_back(choice.values[value]);
    return values;
  }
  [[nodiscard]] static std::vector<double> values_of(const FieldFit& fit) {
    std::vector<double> values = fit.law;
    const std::vector<double> free = free_values(fit.choice);
    values.insert(values.end(), free.begin(), free.end());
    return values;
  }

  [[nodiscard]] ChangedMotion motion_of(const FieldChoice& choice) const {
    ChangedMotion motion(changes_of(choice, specimen_), estimated_.groups, free_values(choice));
    if (base_motion_) motion.begin_at(*base_motion_);
    return motion;
  }

  /// The fit of a choice, from the law's values and pressures of another one.
  [[nodiscard]] FieldFit search(const FieldChoice& choice, const FieldFit& from) {
    const bool is_base = choice.effects.empty();
    std::vector<EstimatedParameter> unknowns = estimated_.values;
    for (size_t i = 0; i < unknowns.size(); ++i)
      unknowns[i].start = std::clamp(from.law[i], unknowns[i].lower, unknowns[i].upper);
    for (const size_t value : choice.free) {
      const EffectParameter& parameter = choice.parameter(value);
      unknowns.push_back({std::clamp(choice.values[value], parameter.lower, parameter.upper), parameter.lower,
                          parameter.upper, std::string(parameter.name)});
    }
    auto motion = std::make_unique<ChangedMotion>(motion_of(choice));
    JointProblem problem(*motion, unknowns, field_.measurement, field_.locator);
    problem.set_robust(loss_);
    VectorXd start = problem.start();
    for (size_t slot = 0; slot < from.pressures_kPa.size(); ++slot)
      start[*problem.frames()[slot].pressure_unknown] = from.pressures_kPa[slot];
    FieldFit fit;
    fit.choice = choice;
    fit.chi_square = HUGE_VAL;
    // The points are those on the body of the base model, so that all fits have the same.
    VectorXd base = start;
    const auto law = static_cast<Index>(estimated_.values.size());
    for (size_t i = 0; i < choice.free.size(); ++i)
      base[law + static_cast<Index>(i)] =
          problem.space()[law + static_cast<Index>(i)].coordinate(choice.parameter(choice.free[i]).neutral);
    if (!problem.find_points(is_base ? start : base)) return fit;
    if (rows_ && problem.motion_residuals().size() != rows_->size()) return fit;
    problem.set_correction(correction_);
    inference::SearchOptions options;
    options.iteration_limit = iteration_limit;
    options.refusal_limit = 12;
    options.small_gain = [](double) { return worth_a_step; };
    options.on_step = [this](const inference::SearchStep&) { alive(); };
    const inference::SearchResult found = inference::minimise(problem, start, options);
    if (found.residuals.size() == 0 || !problem.residuals(found.q)) return fit;
    take(found, problem, fit);
    if (is_base) {
      std::vector<const MotionResiduals*> frames;
      for (const JointProblem::LoadedFrame& frame : problem.frames())
        frames.push_back(&frame.residuals);
      rows_ = MotionResiduals::joined(frames);
      base_motion_ = std::move(motion);
    }
    return fit;
  }

  /// What a finer mesh changes at a fit; nothing where it has no equilibrium.
  [[nodiscard]] std::optional<VectorXd> correction_at(const FieldFit& fit) {
    if (!finer_) finer_.emplace(on_finer_mesh(study_));
    ChangedMotion own = motion_of(fit.choice);
    ChangedMotion finer(changes_of(fit.choice, *finer_), estimated_.groups, free_values(fit.choice));
    const std::vector<double> values = values_of(fit);
    std::vector<NodeField> position_mm;
    for (size_t slot = 0; slot < fit.pressures_kPa.size(); ++slot) {
      alive();
      MotionOutcome outcome = own.solve(slot, values, fit.pressures_kPa[slot]);
      if (!outcome.position_mm) return {};
      position_mm.push_back(*std::move(outcome.position_mm));
    }
    return finer_mesh_correction(finer, {mesh(), position_mm, values, fit.pressures_kPa}, *rows_,
                                 field_.locator);
  }

  /// Of all fits' rows, at the base; and what it may leave.
  void correct_mesh() {
    std::optional<VectorXd> correction = correction_at(base_);
    if (!correction) return;
    correction_ = *std::move(correction);
    base_ = search({}, base_);
    const MatrixXd column = error_left_on_finer_mesh * correction_;
    mesh_error_ = LinearEvidence(base_, column).size(0);
  }

  /// Numbers of a fit at the search's end.
  void take(const inference::SearchResult& found, JointProblem& problem, FieldFit& fit) const {
    const std::vector<double> values = problem.space().values(found.q);
    const size_t law = estimated_.values.size();
    fit.termination = found.termination;
    fit.law.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(law));
    fit.jacobian = problem.jacobian(found.q);
    for (size_t i = 0; i < fit.choice.free.size(); ++i) {
      const size_t value = fit.choice.free[i];
      fit.choice.values[value] = values[law + i];
      // Of the coordinate in which the parameter is reported.
      const auto column = static_cast<Index>(law + i);
      const bool by_logarithm = problem.space()[column].scale == inference::Scale::logarithmic;
      if (by_logarithm && fit.choice.parameter(value).scale == SearchScale::linear)
        fit.jacobian.col(column) /= values[law + i];
    }
    fit.pressures_kPa.clear();
    for (const JointProblem::LoadedFrame& frame : problem.frames())
      fit.pressures_kPa.push_back(values[static_cast<size_t>(*frame.pressure_unknown)]);
    const Index rows = problem.motion_residuals().size();
    fit.residuals = found.residuals.head(rows);
    fit.priors = found.residuals.tail(found.residuals.size() - rows);
    fit.chi_square = found.residuals.squaredNorm();
    std::vector<bool> is_free(found.pressed);
    is_free.flip();
    fit.covariance = inference::estimate_covariance(fit.jacobian, is_free).matrix;
  }

  /// Derivatives of the rows at the base by changes.
  [[nodiscard]] MatrixXd columns_of(const std::vector<ChangedMotion::Perturbation>& changes) {
    MatrixXd columns(rows_->size(), static_cast<Index>(changes.size()));
    for (size_t slot = 0; slot < base_.pressures_kPa.size(); ++slot) {
      alive();
      const std::vector<NodeField> fields = base_motion_->by_changes(slot, changes);
      columns.middleRows(rows_->first(slot), rows_->count(slot)) =
          rows_->columns(slot, mesh(), pointers_to(fields));
    }
    return columns;
  }

  /// The effect at these values, less little and more.
  [[nodiscard]] ChangedMotion::Perturbation little(const Effect& effect, std::vector<double> values,
                                                   size_t parameter) const {
    const double step = step_of(effect.field_parameters()[parameter]);
    ChangedMotion::Perturbation change{field_.base, field_.base, 2.0 * step};
    const double middle = values[parameter];
    values[parameter] = middle + step;
    effect.apply_to_field(values, change.up);
    values[parameter] = middle - step;
    effect.apply_to_field(values, change.down);
    return change;
  }

  /// Of all effects but an inclusion; each with the amount that the base's residuals ask for as its start.
  [[nodiscard]] std::vector<FieldHypothesis> linear_gains() {
    constexpr int directions = 12;
    struct Part {
      const Effect* effect;
      Index first;
      Index count;
    };
    std::vector<Part> parts;
    std::vector<ChangedMotion::Perturbation> changes;
    for (const Effect* effect : effects_) {
      if (effect->is_inclusion()) continue;
      const auto first = static_cast<Index>(changes.size());
      std::vector<double> values = effect->field_neutral(field_.base);
      if (const auto direction = effect->field_direction()) {
        for (int i = 0; i < directions; ++i) {
          values[direction->parameter] = direction->half_turn * i / directions;
          changes.push_back(little(*effect, values, 0));
        }
      } else {
        for (size_t i = 0; i < effect->field_essentials(); ++i)
          changes.push_back(little(*effect, values, i));
      }
      parts.push_back({effect, first, static_cast<Index>(changes.size()) - first});
    }
    const LinearEvidence evidence(base_, columns_of(changes));
    std::vector<FieldHypothesis> tried;
    for (const Part& part : parts) {
      FieldHypothesis hypothesis{{std::string(part.effect->text().id)}, base_};
      FieldChoice& choice = hypothesis.fit.choice;
      choice = {{part.effect}, part.effect->field_neutral(field_.base), {}};
      for (size_t i = 0; i < part.effect->field_essentials(); ++i)
        choice.free.push_back(i);
      if (const auto direction = part.effect->field_direction()) {
        choose_direction(*part.effect, *direction, evidence, part.first, part.count, hypothesis);
      } else {
        std::vector<Index> own;
        for (Index i = 0; i < part.count; ++i) {
          own.push_back(part.first + i);
          choice.values[static_cast<size_t>(i)] += evidence.amount(part.first + i);
        }
        hypothesis.gain = evidence.gain(own).chi_square;
      }
      judge(hypothesis, static_cast<double>(choice.free.size()), static_cast<double>(effects_.size()));
      hypothesis.refitted = false;
      hypothesis.fit.chi_square = base_.chi_square - hypothesis.gain;
      tried.push_back(std::move(hypothesis));
    }
    return tried;
  }

  /// The direction in which a little of the effect would gain most, of those in which the residuals ask for a positive amount if the
  /// size has no negative values.
  static void choose_direction(const Effect& effect, const FieldDirection& direction,
                               const LinearEvidence& evidence, Index first, Index count,
                               FieldHypothesis& hypothesis) {
    const EffectParameter& size = effect.field_parameters()[0];
    std::vector<double>& values = hypothesis.fit.choice.values;
    values[0] = size.typical;
    for (Index i = 0; i < count; ++i) {
      const double amount = evidence.amount(first + i);
      const double gain = evidence.gain(first + i);
      if (amount <= size.lower || gain < hypothesis.gain) continue;
      hypothesis.gain = gain;
      values[0] = amount;
      values[direction.parameter] = direction.half_turn * static_cast<double>(i) / static_cast<double>(count);
    }
  }

  /// The score pays two for each parameter, and for the number of alternatives.
  void judge(FieldHypothesis& hypothesis, double parameters, double alternatives) const {
    hypothesis.score = hypothesis.gain - mesh_error_ - 2.0 * parameters;
    hypothesis.p_value = beyond_mesh(hypothesis.gain, parameters, alternatives);
  }
  void judge_inclusion(FieldHypothesis& hypothesis, double places, double alternatives) const {
    hypothesis.score = hypothesis.gain - mesh_error_ - 2.0 * effective_parameters - 2.0 * std::log(places);
    hypothesis.p_value = beyond_mesh(hypothesis.gain, effective_parameters, alternatives * places);
  }
  /// Of a gain, less what the mesh may make of it.
  [[nodiscard]] double beyond_mesh(double gain, double degrees, double alternatives) const {
    return std::min(1.0, alternatives * chi_square_tail(std::max(0.0, gain - mesh_error_), degrees));
  }

  [[nodiscard]] double places() const { return distinct_places(volume_mm3_); }

  [[nodiscard]] FieldHypothesis inclusion_from(const InclusionGuess& guess, const FieldFit& beside) const {
    const Effect& effect = inclusion_effect();
    const Inclusion& at = guess.inclusion;
    FieldHypothesis hypothesis{{std::string(effect.text().id)}, beside};
    hypothesis.fit.choice = {{&effect},
                             {at.contrast, at.radius_mm, at.z_mm, at.theta_deg, at.semi_axes_mm[0],
                              at.semi_axes_mm[1], at.semi_axes_mm[2]},
                             {}};
    for (size_t i = 0; i < effect.field_essentials(); ++i)
      hypothesis.fit.choice.free.push_back(i);
    hypothesis.gain = guess.gain;
    hypothesis.refitted = false;
    return hypothesis;
  }

  void add_inclusion(std::vector<FieldHypothesis>& tried) {
    if (std::ranges::find(effects_, &inclusion_effect()) == effects_.end()) return;
    std::vector<double> shares = base_.pressures_kPa;
    for (double& share : shares)
      share /= base_.pressures_kPa[highest_slot()];
    const ChangedMotion::Equilibrium at = base_motion_->equilibrium(highest_slot());
    lattice_ = inclusion_lattice(*rows_, at.body, at.state, shares);
    const InclusionGuess guess = search_inclusion(*lattice_, volume_mm3_, base_).front();
    FieldHypothesis hypothesis = inclusion_from(guess, base_);
    judge_inclusion(hypothesis, places(), static_cast<double>(effects_.size()));
    hypothesis.p_value = beyond_mesh(guess.gain, 1.0, places() * static_cast<double>(effects_.size()));
    tried.push_back(std::move(hypothesis));
  }

  /// The essentials first, then all parameters if they pay.
  [[nodiscard]] FieldFit fit_from(const FieldChoice& choice, const FieldFit& start) {
    FieldFit fit = search(choice, start);
    if (choice.free.size() == choice.values.size() || !std::isfinite(fit.chi_square)) return fit;
    FieldChoice all = fit.choice;
    all.free.clear();
    for (size_t i = 0; i < choice.values.size(); ++i) {
      if (std::ranges::find(choice.free, i) == choice.free.end() &&
          choice.parameter(i).scale == SearchScale::linear)
        all.values[i] = choice.parameter(i).typical;
      all.free.push_back(i);
    }
    FieldFit fuller = search(all, fit);
    return fit.chi_square - fuller.chi_square > worth_freeing ? fuller : fit;
  }

  void refit(FieldHypothesis& hypothesis) {
    hypothesis.fit = fit_from(hypothesis.fit.choice, base_);
    hypothesis.gain = base_.chi_square - hypothesis.fit.chi_square;
    hypothesis.refitted = true;
    const auto alternatives = static_cast<double>(effects_.size());
    if (hypothesis.has_inclusion()) {
      judge_inclusion(hypothesis, places(), alternatives);
    } else {
      judge(hypothesis, static_cast<double>(hypothesis.fit.choice.free.size()), alternatives);
    }
  }

  /// Both effects together, judged by what they gain over the better one.
  [[nodiscard]] std::optional<FieldHypothesis> beside(const FieldHypothesis& first,
                                                      const FieldHypothesis& second) {
    FieldChoice choice = second.fit.choice;
    double rooms = first.has_inclusion() ? places() : 1.0;
    if (second.has_inclusion()) {
      const InclusionGuess guess = search_inclusion(*lattice_, volume_mm3_, first.fit).front();
      if (guess.p_value > beyond_chance) return {};
      choice = inclusion_from(guess, first.fit).fit.choice;
      rooms = places();
    }
    FieldHypothesis pair{{first.ids.front(), second.ids.front()},
                         search(together(first.fit.choice, choice), first.fit)};
    std::ranges::sort(pair.ids);
    const auto parameters = static_cast<double>(pair.fit.choice.free.size());
    const auto all = static_cast<double>(effects_.size());
    const double tried = 0.5 * all * (all - 1.0) * rooms;
    pair.gain = base_.chi_square - pair.fit.chi_square;
    pair.score = pair.gain - mesh_error_ - 2.0 * parameters - 2.0 * std::log(tried);
    pair.p_value =
        beyond_mesh(pair.gain - std::max(first.gain, second.gain), std::max(1.0, parameters - 1.0), tried);
    return pair;
  }

  FieldProgress progress_;
  Study study_;
  ChangeableSpecimen specimen_;
  EstimatedParameters estimated_;
  std::vector<const Effect*> effects_;
  double volume_mm3_;
  FieldCase field_;
  std::optional<RobustLoss> loss_;
  FieldFit base_;
  std::optional<MotionResiduals> rows_;
  std::unique_ptr<ChangedMotion> base_motion_;
  std::optional<InclusionLattice> lattice_;
  std::optional<ChangeableSpecimen> finer_;
  VectorXd correction_;      // of the rows, by the finer mesh; empty: not known
  double mesh_error_ = 0.0;  // of chi2
};

}  // namespace

std::unique_ptr<ImagedSpecimen> any_specimen(const Study& study, const FieldProgress& progress) {
  require_shape_without_load(study, "effects in images");
  for (const StudyParameter& parameter : study.law.parameters)
    if (parameter.vary == Variation::element)
      refuse(study, "law.parameters." + parameter.name + ".vary",
             "images are explained from a specimen of one stiffness, not of one value an element",
             "Set vary = \"whole\": a region of another stiffness is then found by name. `diastole fit` maps "
             "one "
             "value an element.");
  if (!study.data.tags && !study.data.points)
    refuse(study, "data", "the study has neither tags nor points",
           "Name a tags or points file and its frames.");
  return std::make_unique<AnySpecimen>(study, progress);
}

}  // namespace diastole::explain
