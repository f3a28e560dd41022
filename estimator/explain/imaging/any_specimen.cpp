// Any specimen that `fit` takes, on the study's own mesh (specimen_problem.hpp).
//
// Every effect is first judged by its linear response at the base, one back-substitution a parameter and frame; only what could be
// beyond chance is fitted with all else.

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/explain/imaging/imaged_specimen.hpp"
#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/explain/imaging/specimen_problem.hpp"
#include "estimator/fe/body_volume.hpp"
#include "estimator/inference/tail_probability.hpp"
#include "estimator/io/study_refusal.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

class AnySpecimen final : public ImagedSpecimen {
 public:
  AnySpecimen(const Study& study, const FieldProgress& progress)
      : progress_(progress),
        problem_(study, [this](const std::string& text) { report(text); }),
        effects_(problem_.specimen().effects()),
        volume_mm3_(volume_mm3(problem_.mesh(), problem_.mesh().reference())) {}

  void fit_base() override { problem_.fit_base(); }
  void widen_sigmas(double factor) override { problem_.field().widen_sigmas(factor); }

  [[nodiscard]] const FieldCase& field() const override { return problem_.field(); }
  [[nodiscard]] const MotionResiduals& rows() const override { return problem_.rows(); }
  [[nodiscard]] const HermiteMesh& mesh() const override { return problem_.mesh(); }
  [[nodiscard]] const FieldFit& base() const override { return problem_.base(); }
  [[nodiscard]] FieldModes modes() override {
    const ChangedMotion::Equilibrium at = problem_.highest();
    return field_modes(rows(), at.body, at.state, base().pressures_kPa);
  }
  [[nodiscard]] double mesh_error() const override { return problem_.mesh_error(); }
  void settle(FieldHypothesis& hypothesis) override { hypothesis.fit = problem_.settled(hypothesis.fit); }
  [[nodiscard]] std::vector<ParameterShift> shifts(const FieldFit& after) const override {
    return problem_.shifts(after);
  }
  [[nodiscard]] double volume_change_mL(const FieldHypothesis& hypothesis) override {
    return problem_.volume_change_mL(hypothesis.fit);
  }

  [[nodiscard]] std::vector<FieldHypothesis> singles() override {
    std::vector<FieldHypothesis> tried = linear_gains();
    add_inclusion(tried);
    std::ranges::stable_sort(tried, std::greater{}, &FieldHypothesis::gain);
    for (FieldHypothesis& hypothesis : tried) {
      if (hypothesis.p_value > suspected) continue;
      report("fitting " + hypothesis.name());
      refit(hypothesis);
    }
    return tried;
  }

  [[nodiscard]] std::vector<FieldHypothesis> pairs(const std::vector<FieldHypothesis>& singles) override {
    std::vector<FieldHypothesis> found;
    const size_t begun = std::min(firsts, singles.size());
    for (size_t a = 0; a < begun; ++a) {
      if (!singles[a].refitted || !std::isfinite(singles[a].fit.chi_square)) continue;
      for (size_t b = 0; b < singles.size(); ++b) {
        if (b == a || (b < a && singles[b].refitted)) continue;
        report("fitting " + singles[a].name() + " + " + singles[b].name());
        if (std::optional<FieldHypothesis> pair = beside(singles[a], singles[b]))
          found.push_back(*std::move(pair));
      }
    }
    std::ranges::stable_sort(found, std::greater{}, &FieldHypothesis::score);
    return found;
  }

 private:
  void report(const std::string& text) const {
    if (progress_) progress_(text);
  }

  /// The effect at these values, less little and more.
  [[nodiscard]] ChangedMotion::Perturbation little(const Effect& effect, std::vector<double> values,
                                                   size_t parameter) const {
    const double step = SpecimenProblem::step_of(effect.field_parameters()[parameter]);
    ChangedMotion::Perturbation change{field().base, field().base, 2.0 * step};
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
      std::vector<double> values = effect->field_neutral(field().base);
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
    const LinearEvidence evidence(base(), problem_.columns_of(changes));
    std::vector<FieldHypothesis> tried;
    for (const Part& part : parts) {
      FieldHypothesis hypothesis{{std::string(part.effect->text().id)}, base()};
      FieldChoice& choice = hypothesis.fit.choice;
      choice = {{part.effect}, part.effect->field_neutral(field().base), {}};
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
      hypothesis.fit.chi_square = base().chi_square - hypothesis.gain;
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
    hypothesis.score = hypothesis.gain - mesh_error() - 2.0 * parameters;
    hypothesis.p_value = beyond_mesh(hypothesis.gain, parameters, alternatives);
  }
  void judge_inclusion(FieldHypothesis& hypothesis, double places, double alternatives) const {
    hypothesis.score = hypothesis.gain - mesh_error() - 2.0 * effective_parameters - 2.0 * std::log(places);
    hypothesis.p_value = beyond_mesh(hypothesis.gain, effective_parameters, alternatives * places);
  }
  /// Of a gain, less what the mesh may make of it.
  [[nodiscard]] double beyond_mesh(double gain, double degrees, double alternatives) const {
    return std::min(1.0,
                    alternatives * inference::chi_square_tail(std::max(0.0, gain - mesh_error()), degrees));
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
    std::vector<double> shares = base().pressures_kPa;
    for (double& share : shares)
      share /= base().pressures_kPa[problem_.highest_slot()];
    const ChangedMotion::Equilibrium at = problem_.highest();
    lattice_ = inclusion_lattice(rows(), at.body, at.state, shares);
    const InclusionGuess guess = search_inclusion(*lattice_, volume_mm3_, base()).front();
    FieldHypothesis hypothesis = inclusion_from(guess, base());
    judge_inclusion(hypothesis, places(), static_cast<double>(effects_.size()));
    hypothesis.p_value = beyond_mesh(guess.gain, 1.0, places() * static_cast<double>(effects_.size()));
    tried.push_back(std::move(hypothesis));
  }

  /// The essentials first, then all parameters if they pay.
  [[nodiscard]] FieldFit fit_from(const FieldChoice& choice, const FieldFit& start) {
    FieldFit fit = problem_.fit(choice, start);
    if (choice.free.size() == choice.values.size() || !std::isfinite(fit.chi_square)) return fit;
    FieldChoice all = fit.choice;
    all.free.clear();
    for (size_t i = 0; i < choice.values.size(); ++i) {
      if (std::ranges::find(choice.free, i) == choice.free.end() &&
          choice.parameter(i).scale == SearchScale::linear)
        all.values[i] = choice.parameter(i).typical;
      all.free.push_back(i);
    }
    FieldFit fuller = problem_.fit(all, fit);
    return fit.chi_square - fuller.chi_square > worth_freeing ? fuller : fit;
  }

  void refit(FieldHypothesis& hypothesis) {
    hypothesis.fit = fit_from(hypothesis.fit.choice, base());
    hypothesis.gain = base().chi_square - hypothesis.fit.chi_square;
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
    double place_count = first.has_inclusion() ? places() : 1.0;
    if (second.has_inclusion()) {
      const InclusionGuess guess = search_inclusion(*lattice_, volume_mm3_, first.fit).front();
      if (guess.p_value > beyond_chance) return {};
      choice = inclusion_from(guess, first.fit).fit.choice;
      place_count = places();
    }
    FieldHypothesis pair{{first.ids.front(), second.ids.front()},
                         problem_.fit(together(first.fit.choice, choice), first.fit)};
    std::ranges::sort(pair.ids);
    const auto parameters = static_cast<double>(pair.fit.choice.free.size());
    const auto all = static_cast<double>(effects_.size());
    const double tried = 0.5 * all * (all - 1.0) * place_count;
    pair.gain = base().chi_square - pair.fit.chi_square;
    pair.score = pair.gain - mesh_error() - 2.0 * parameters - 2.0 * std::log(tried);
    pair.p_value =
        beyond_mesh(pair.gain - std::max(first.gain, second.gain), std::max(1.0, parameters - 1.0), tried);
    return pair;
  }

  FieldProgress progress_;
  SpecimenProblem problem_;
  std::vector<const Effect*> effects_;
  double volume_mm3_;
  std::optional<InclusionLattice> lattice_;
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
