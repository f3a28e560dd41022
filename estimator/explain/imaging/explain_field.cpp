#include "estimator/explain/imaging/explain_field.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "estimator/explain/imaging/field_hypotheses.hpp"
#include "estimator/explain/imaging/field_misfit.hpp"
#include "estimator/explain/imaging/field_modes.hpp"
#include "estimator/explain/imaging/field_next_experiment.hpp"
#include "estimator/explain/imaging/inclusion_fit.hpp"
#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/explain/imaging/prior_strain.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/tail_probability.hpp"
#include "estimator/model/affected_model.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

constexpr double significant = 1e-3;
constexpr double suspicious = 1e-2;     // of what one effect leaves: reason to try two
constexpr double indistinct = 9.0;      // of the score
constexpr double clearly_better = 6.0;  // of a rival's score
constexpr double far_better = 1.5;      // a rival's score over the best effect's: pairs will not do either
/// Part of an effect's gain that meshes of this size may leave as structure.
constexpr double mesh_error = 0.01;

struct Family {
  std::string name;
  std::vector<Index> columns;
};

/// Structure beyond noise, whatever it is.
struct Structure {
  std::string family;
  double excess = 0.0;
  double p_value = 1.0;
};

class Explainer {
 public:
  Explainer(ImagedSpecimen& specimen, const FieldProgress& progress)
      : progress_(progress), specimen_(specimen) {}

  Explanation run() {
    fit_base();
    fit_effects();
    judge();
    const FieldFit& explaining = chosen_ != nullptr ? chosen_->fit : specimen_.base();
    out_.law = specimen_.shifts(explaining);
    for (const std::string& combination : explaining.undetermined)
      out_.summary +=
          fmt::format(" Nothing in these data changes along {}: they do not determine it.", combination);
    if (widened_ > 1.0)
      out_.summary += fmt::format(
          " Neighbouring tags are off alike: all is judged with their sigmas {:.2f} times as large.",
          widened_);
    fill_evidence();
    fill_field();
    propose();
    return std::move(out_);
  }

 private:
  void report(const std::string& text) const {
    if (progress_) progress_(text);
  }

  void fit_base() {
    report("fitting the base model to the tags");
    specimen_.fit_base();
    report("looking for structure in what is left");
    modes_ = specimen_.modes();
    widen_for_neighbours();
    for (size_t i = 0; i < modes_.modes.size(); ++i) {
      const std::string& family = modes_.modes[i].family;
      auto same = std::ranges::find(families_, family, &Family::name);
      if (same == families_.end()) same = families_.insert(same, {.name = family, .columns = {}});
      same->columns.push_back(static_cast<Index>(i));
      if (modes_.modes[i].smooth) rivals_.push_back(static_cast<Index>(i));
    }
  }

  /// Tags that were found in images are off alike where they are neighbours: a ghost, a fold, the smoothness of the search. By how much is seen in
  /// motions of an order that hardly any effect makes: their chi2 a degree of freedom is what all gains are measured in.
  void widen_for_neighbours() {
    if (!specimen_.field().measurement.planes_as_seen) return;
    std::vector<Index> rough;
    for (size_t i = 0; i < modes_.modes.size(); ++i)
      if (modes_.modes[i].rough) rough.push_back(static_cast<Index>(i));
    const LinearEvidence::Gain gain =
        LinearEvidence(specimen_.base_of_structure(), modes_.columns).gain(rough);
    if (gain.degrees == 0) return;
    widened_ = std::sqrt(gain.chi_square / static_cast<double>(gain.degrees));
    if (!(widened_ > 1.0)) return;
    specimen_.widen_sigmas(widened_);
    specimen_.fit_base();
    modes_ = specimen_.modes();
  }

  void fit_effects() {
    report("fitting each effect");
    hypotheses_ = specimen_.singles();
    std::ranges::stable_sort(hypotheses_, std::greater{}, &FieldHypothesis::score);
  }

  /// The family of modes in which the fit leaves most structure.
  [[nodiscard]] Structure structure_left(const FieldFit& fit, double allowed) const {
    const LinearEvidence evidence(fit, modes_.columns);
    Structure most;
    for (const Family& family : families_) {
      const LinearEvidence::Gain gain = evidence.gain(family.columns);
      const auto degrees = static_cast<double>(gain.degrees);
      const double p = std::min(
          1.0, static_cast<double>(families_.size()) *
                   inference::chi_square_tail(gain.chi_square - allowed - specimen_.mesh_error(), degrees));
      if (p < most.p_value) most = {family.name, gain.chi_square - degrees, p};
    }
    return most;
  }

  /// How seldom pressures, C1 and the radius are as far off as that by their errors and the mesh's.
  [[nodiscard]] double strain(const FieldFit& fit) const {
    const PriorStrain strain = prior_strain(fit);
    return inference::chi_square_tail(strain.chi_square - specimen_.mesh_error(), strain.degrees);
  }
  /// A frame whose pressure the motion contradicts.
  struct PressureStrain {
    int frame = 0;
    double measured_kPa = 0.0, needed_kPa = 0.0, sds = 0.0;
  };
  /// If it is a pressure that is furthest off, and beyond what one in two thousand is.
  [[nodiscard]] std::optional<PressureStrain> contradicted_pressure(const FieldFit& fit) const {
    constexpr double significant_sds = 3.5;
    const PriorStrain strain = prior_strain(fit);
    Index slot = 0;
    if (!(strain.off.cwiseAbs().maxCoeff(&slot) > significant_sds)) return std::nullopt;
    if (slot >= static_cast<Index>(fit.pressures_kPa.size())) return std::nullopt;
    const int number = specimen_.rows().frames()[static_cast<size_t>(slot)];
    const Frame& frame = specimen_.field().measurement.frames[static_cast<size_t>(number)];
    return PressureStrain{
        number, frame.pressure_kPa,
        frame.pressure_kPa + strain.deleted[slot] / fit.priors[slot] *
                                 (fit.pressures_kPa[static_cast<size_t>(slot)] - frame.pressure_kPa),
        strain.off[slot]};
  }
  /// As hypotheses are scored: one parameter, and the readings to choose from.
  [[nodiscard]] double score_of(const PressureStrain& worst) const {
    return worst.sds * worst.sds - specimen_.mesh_error() - 2.0 -
           2.0 * std::log(static_cast<double>(specimen_.base().pressures_kPa.size()));
  }
  [[nodiscard]] static std::string words_of(const PressureStrain& worst) {
    return fmt::format(
        " Frame {} was at {:.4g} kPa and would have to be at {:.4g} ({:+.1f} standard deviations): check "
        "when its pressure was read and with which zero, or state a larger sigma_kPa.",
        worst.frame, worst.measured_kPa, worst.needed_kPa, worst.sds);
  }
  [[nodiscard]] std::string words_of_strain(const FieldFit& fit) const {
    if (const auto pressure = contradicted_pressure(fit)) return words_of(*pressure);
    return " What is known of the loads, of C1 or of the shape would have to be further off than its error "
           "allows.";
  }

  /// Where the best single effect leaves something, pairs are fitted; they count if one is clearly better.
  void try_pairs() {
    const FieldHypothesis single = hypotheses_.front();
    if (rival_.score > far_better * single.score) return;
    if (structure_left(single.fit, mesh_error * single.gain).p_value > suspicious &&
        strain(single.fit) > suspicious)
      return;
    report("fitting pairs of effects");
    std::vector<FieldHypothesis> pairs = specimen_.pairs(hypotheses_);
    if (pairs.empty() || pairs.front().score < single.score + clearly_better ||
        pairs.front().p_value > significant)
      return;
    std::ranges::move(pairs, std::back_inserter(hypotheses_));
    std::ranges::stable_sort(hypotheses_, std::greater{}, &FieldHypothesis::score);
  }

  void judge() {
    report("comparing what explains it");
    const FieldFit& base = specimen_.base();
    const FieldFit& finest = specimen_.base_of_structure();
    rival_ = LinearEvidence(finest, modes_.columns).best_of(rivals_);
    rival_.score -= specimen_.mesh_error();
    if (!settled(base) || (&finest != &base && !settled(finest))) return;
    const Structure before = structure_left(finest, 0.0);
    const FieldHypothesis& single = hypotheses_.front();
    const bool effect_seen = single.p_value < significant && single.score > 0.0;
    if (effect_seen) try_pairs();
    FieldHypothesis& best = hypotheses_.front();
    if (!effect_seen && before.p_value > significant) {
      doubts_loads_ = strain(base) < significant;
      out_.verdict = doubts_loads_ ? Verdict::unexplained : Verdict::none;
      out_.summary =
          doubts_loads_
              ? fmt::format(
                    "The motion differs from the model's by noise alone, but only at loads that were not "
                    "measured.{} No effect of the library does that.",
                    words_of_strain(base))
              : fmt::format(
                    "Nothing exceeds the noise: {} {} residuals of the motion; the nearest effect, {}, "
                    "would gain {:.1f} of chi2.",
                    law_before(), base.residuals.size(), best.name(), best.gain);
      return;
    }
    if (effect_seen) specimen_.settle(best);
    const std::string open = effect_seen ? what_stays_open(best.fit) : "";
    const Structure after = effect_seen ? structure_left(best.fit, mesh_error * best.gain) : before;
    const bool rivalled = rival_.score > best.score + clearly_better;
    const std::optional<PressureStrain> reading = contradicted_pressure(base);
    doubts_loads_ = reading && score_of(*reading) > std::max(best.score, rival_.score) + clearly_better;
    if (!effect_seen || rivalled || doubts_loads_ || after.p_value < significant || !open.empty()) {
      out_.verdict = Verdict::unexplained;
      out_.summary = unexplained_summary(best, effect_seen, rivalled, after) + open;
      if (doubts_loads_)
        out_.summary += fmt::format(" One wrong reading would gain {:.1f} of chi2.{}",
                                    reading->sds * reading->sds, words_of(*reading));
      return;
    }
    if (settled(best.fit)) name(best);
  }

  /// Keeps how a fit's search ended; false, and nothing is named, unless it ended where it was to.
  [[nodiscard]] bool settled(const FieldFit& fit) {
    SearchEnd& search = out_.searches.emplace_back();
    search.termination = fit.termination;
    for (const Effect* effect : fit.choice.effects)
      search.effects.emplace_back(effect->text().id);
    out_.converged = is_settled(out_.searches);
    if (out_.converged) return true;
    const std::string of =
        search.effects.empty() ? "the base model" : fmt::format("{}", fmt::join(search.effects, " + "));
    out_.verdict = Verdict::unexplained;
    out_.summary = fmt::format("Nothing can be named. The search of {} did not converge: {}", of,
                               inference::sentence(fit.termination));
    return false;
  }

  /// Why an effect that bends to almost any misfit - a region, a direction - is none that can be named: its size may be neutral, or it would
  /// be larger than such a region can be. Empty: it can be.
  [[nodiscard]] std::string what_stays_open(const FieldFit& fit) const {
    size_t first = 0;
    for (const Effect* effect : fit.choice.effects) {
      const auto parameters = effect->field_parameters();
      const FoundParameter size = found_parameter(fit, first);
      if ((effect->is_inclusion() || effect->field_direction()) && size.ci90[0] <= parameters[0].neutral &&
          parameters[0].neutral <= size.ci90[1])
        return fmt::format(" Of {} not even {} is certain: {:.3g}, 90 % within {:.3g} to {:.3g}.",
                           effect->text().id, size.name, size.value, size.ci90[0], size.ci90[1]);
      // One that goes through the whole wall may be longer that way: beyond the wall it changes nothing.
      for (size_t i = 1; effect->is_inclusion() && i < parameters.size(); ++i)
        if (fit.choice.values[first + i] >= parameters[i].upper &&
            parameters[i].name != "semi_axis_radial_mm")
          return fmt::format(" Its {} would be {:g} or more.", parameters[i].name, parameters[i].upper);
      first += parameters.size();
    }
    return "";
  }

  [[nodiscard]] std::string unexplained_summary(const FieldHypothesis& best, bool effect_seen, bool rivalled,
                                                const Structure& after) const {
    std::string text =
        "The motion differs from the model's beyond noise, and no effect of the library removes that.";
    if (effect_seen)
      text += fmt::format(" The best one, {}, gains {:.1f} of chi2 and leaves {:.1f} ({}; p = {:.1g}).",
                          best.name(), best.gain, after.excess, after.family, after.p_value);
    if (rivalled || (rival_.score > 0.0 && rival_.chi_square > 0.5 * best.gain)) {
      std::vector<std::string> names;
      for (const Index column : rival_.columns)
        names.push_back(modes_.modes[static_cast<size_t>(column)].name);
      text += fmt::format(" Something outside the library would gain {:.1f}: {}.", rival_.chi_square,
                          fmt::join(names, "; "));
    }
    return text;
  }

  void name(const FieldHypothesis& best) {
    out_.effects = found(best);
    for (const FieldHypothesis& other : hypotheses_) {
      if (&other == &best || other.score < best.score - indistinct || other.p_value > 10.0 * significant)
        continue;
      if (structure_left(other.fit, mesh_error * other.gain).p_value < significant) continue;
      out_.ambiguous_with.push_back(other.ids);
    }
    out_.verdict = out_.ambiguous_with.empty() ? Verdict::named : Verdict::ambiguous;
    out_.shifts = specimen_.shifts(best.fit);
    out_.summary = fmt::format("{} explains what the base model does not: chi2 falls by {:.1f}{}.",
                               best.name(), best.gain, law_after());
    if (!out_.ambiguous_with.empty()) {
      std::vector<std::string> ids;
      for (const auto& set : out_.ambiguous_with)
        ids.push_back(fmt::format("{}", fmt::join(set, " + ")));
      out_.summary += fmt::format(" These data cannot tell it from {}.", fmt::join(ids, ", "));
    }
    if (const auto pressure = contradicted_pressure(best.fit)) out_.summary += words_of(*pressure);
    chosen_ = &best;
  }

  /// "C1_kPa = 8.710 explains"
  [[nodiscard]] std::string law_before() const {
    std::vector<std::string> words;
    for (const ParameterShift& shift : specimen_.shifts(specimen_.base()))
      words.push_back(fmt::format("{} = {:.4g}", shift.name, shift.before));
    return fmt::format("{} {}", fmt::join(words, ", "), words.size() == 1 ? "explains" : "explain");
  }
  /// ", C1_kPa becomes 8.710 instead of 8.500"
  [[nodiscard]] std::string law_after() const {
    std::string words;
    for (const ParameterShift& shift : out_.shifts)
      words += fmt::format(", {} becomes {:.4g} instead of {:.4g}", shift.name, shift.after, shift.before);
    return words;
  }

  [[nodiscard]] static std::vector<FoundEffect> found(const FieldHypothesis& hypothesis) {
    std::vector<FoundEffect> effects;
    size_t value = 0;
    for (const Effect* effect : hypothesis.fit.choice.effects) {
      FoundEffect& out = effects.emplace_back(FoundEffect{std::string(effect->text().id), {}, {}});
      for (size_t i = 0; i < effect->field_parameters().size(); ++i)
        out.parameters.push_back(found_parameter(hypothesis.fit, value++));
    }
    std::ranges::sort(effects, {}, &FoundEffect::id);
    return effects;
  }

  [[nodiscard]] static FoundParameter found_parameter(const FieldFit& fit, size_t value) {
    const FieldChoice& choice = fit.choice;
    const EffectParameter& parameter = choice.parameter(value);
    FoundParameter out;
    out.name = parameter.name;
    out.unit = parameter.unit;
    out.value = choice.values[value];
    const auto place = std::ranges::find(choice.free, value);
    if (place == choice.free.end()) {  // it did not pay to free it: it may be anything
      out.ci90 = {parameter.lower, parameter.upper};
      out.standard_error = (parameter.upper - parameter.lower) / (2.0 * inference::normal_90);
      return out;
    }
    const Index unknown = static_cast<Index>(fit.law.size()) + (place - choice.free.begin());
    const inference::Parameter scale = searched(parameter);
    const double coordinate = scale.coordinate(out.value);
    double error = std::sqrt(fit.covariance(unknown, unknown));
    out.ci90 = std::isfinite(error) ? inference::interval(scale, coordinate, inference::normal_90 * error)
                                    : std::array{scale.lower, scale.upper};
    const bool profiled = !fit.ci90.empty() && fit.ci90[value][0] < fit.ci90[value][1];
    if (profiled) out.ci90 = fit.ci90[value];
    if (profiled || !std::isfinite(error))
      error = (scale.coordinate(out.ci90[1]) - scale.coordinate(out.ci90[0])) / (2.0 * inference::normal_90);
    out.standard_error = inference::standard_error(scale, coordinate, error);
    return out;
  }

  /// An inclusion's own place first; all of the specimen where no part of it stands out.
  void find_places() {
    if (doubts_loads_) {
      Misfit& place = out_.where.emplace_back();
      place.port = "field";
      place.channel = "pressures";
      if (const auto pressure = contradicted_pressure(specimen_.base()))
        place.region = fmt::format("frame {}", pressure->frame);
      const PriorStrain off = prior_strain(specimen_.base());
      place.excess_chi2 = off.chi_square - off.degrees;
      place.p_value = strain(specimen_.base());
      return;
    }
    out_.where = misfit_regions(specimen_.mesh(), specimen_.rows(), specimen_.base(), 5);
    const bool included = chosen_ != nullptr && chosen_->has_inclusion();
    if (!included && !out_.where.empty()) return;
    const Structure before = structure_left(specimen_.base_of_structure(), 0.0);
    Misfit place;
    place.port = "field";
    place.channel = "tags";
    place.region = "all of the specimen, in proportion to the load";
    if (included) {
      const Inclusion inclusion = inclusion_of(chosen_->fit);
      place.region = fmt::format("around {:.0f} deg, z {:.0f} mm, {:.0f} mm from the axis",
                                 std::remainder(inclusion.theta_deg - 180.0, 360.0) + 180.0, inclusion.z_mm,
                                 inclusion.radius_mm);
    }
    place.excess_chi2 = std::max(before.excess, hypotheses_.front().gain);
    place.p_value = std::min(before.p_value, hypotheses_.front().p_value);
    out_.where.insert(out_.where.begin(), std::move(place));
  }

  void fill_evidence() {
    const FieldFit& base = specimen_.base();
    for (const FieldHypothesis& tried : hypotheses_) {
      Candidate row;
      row.ids = tried.ids;
      row.chi_square_drop = tried.gain;
      row.refitted = tried.refitted;
      row.parameters = tried.fit.choice.free.size();
      const bool as_good =
          std::ranges::any_of(out_.ambiguous_with, [&](const auto& set) { return set == tried.ids; });
      row.verdict = &tried == chosen_             ? (as_good ? "as good" : "named")
                    : as_good                     ? "as good"
                    : tried.p_value > significant ? "not needed"
                                                  : fmt::format("explains less than the best by {:.1f}",
                                                                hypotheses_.front().score - tried.score);
      if (&tried == chosen_ && out_.verdict == Verdict::ambiguous) row.verdict = "as good";
      out_.evidence.push_back(std::move(row));
    }
    if (out_.verdict == Verdict::none) return;
    find_places();
    const FieldFit& after = chosen_ != nullptr ? chosen_->fit : base;
    Eigen::MatrixXd directions(base.residuals.size(),
                               static_cast<Index>(rivals_.size()) + after.jacobian.cols());
    directions << modes_.columns(Eigen::all, rivals_), after.jacobian.topRows(base.residuals.size());
    out_.gap =
        field_gap(base, after, deal_folds(specimen_.field().measurement, specimen_.rows(), 5), directions);
    out_.steps = {{"", out_.gap.before}};
    if (chosen_ != nullptr) out_.steps.push_back({chosen_->name(), out_.gap.after});
  }

  /// As precise as a drawing needs, so that the file stays small.
  void fill_field() {
    const FieldFit& base = specimen_.base();
    const FieldFit& after = chosen_ != nullptr ? chosen_->fit : base;
    const MotionResiduals& rows = specimen_.rows();
    const double highest_kPa = std::ranges::max(base.pressures_kPa);
    const auto rounded = [](double value, double scale) { return std::round(scale * value) / scale; };
    for (Index i = 0; i < rows.size(); ++i) {
      const ResidualRow& row = rows.rows()[static_cast<size_t>(i)];
      const double share = base.pressures_kPa[row.slot] / highest_kPa;
      FieldResidual seen;
      seen.frame = rows.frames()[row.slot];
      seen.before = rounded(base.residuals[i], 1e3);
      seen.after = rounded(after.residuals[i], 1e3);
      for (size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Index>(k);
        seen.place_mm[k] = rounded(row.X_mm[axis], 1e2);
        seen.per_mm[k] = rounded(-share * row.by_motion[axis], 1e3);
      }
      out_.field.push_back(seen);
    }
  }

  [[nodiscard]] ImagedModel imaged(const FieldHypothesis& hypothesis) {
    return {&hypothesis, specimen_.volume_change_mL(hypothesis)};
  }

  void propose() {
    if (out_.verdict == Verdict::none || doubts_loads_) return;  // the load is to be measured again
    report("designing the next experiment");
    if (out_.verdict == Verdict::unexplained) {
      out_.next_experiment = exposing_images();
      return;
    }
    std::vector<ImagedModel> models{imaged(*chosen_)};
    for (const FieldHypothesis& other : hypotheses_)
      if (std::ranges::find(out_.ambiguous_with, other.ids) != out_.ambiguous_with.end())
        models.push_back(imaged(other));
    out_.next_experiment = models.size() > 1
                               ? separating_images(specimen_.field(), specimen_.rows(), models)
                               : sharpening_images(specimen_.field(), specimen_.rows(), models.front());
  }

  FieldProgress progress_;
  ImagedSpecimen& specimen_;
  FieldModes modes_;
  std::vector<Family> families_;
  std::vector<Index> rivals_;
  std::vector<FieldHypothesis> hypotheses_;
  LinearEvidence::Choice rival_;
  const FieldHypothesis* chosen_ = nullptr;
  // What was read of the loads contradicts a motion that shows nothing else, or one wrong reading would explain more than any effect.
  bool doubts_loads_ = false;
  double widened_ = 1.0;  // of the tags' sigmas
  Explanation out_;
};

Explanation explain(ImagedSpecimen& specimen, const std::string& name, const FieldProgress& progress) {
  const auto begun = std::chrono::steady_clock::now();
  Explanation explanation = Explainer(specimen, progress).run();
  explanation.study = name;
  explanation.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return explanation;
}

}  // namespace

Explanation explain_field(const Study& study, const FieldProgress& progress) {
  if (is_gel(study) && !study.compression.bulk_modulus_kPa)
    return explain_field(field_case(study), study.file.string(), progress);
  return explain(*any_specimen(study, progress), study.file.string(), progress);
}

Explanation explain_field(FieldCase field, const std::string& name, const FieldProgress& progress) {
  if (progress) field.alive = [&progress] { progress(""); };
  return explain(*gel_specimen(std::move(field), name), name, progress);
}

}  // namespace diastole::explain
