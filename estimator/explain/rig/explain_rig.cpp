#include "estimator/explain/rig/explain_rig.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "estimator/explain/rig/findings.hpp"
#include "estimator/explain/rig/held_out.hpp"
#include "estimator/explain/rig/learned_term.hpp"
#include "estimator/explain/rig/learnt_effects.hpp"
#include "estimator/explain/rig/next_experiment.hpp"
#include "estimator/explain/rig/part_strain.hpp"
#include "estimator/explain/rig/reference_file.hpp"
#include "estimator/explain/rig/set_verdict.hpp"
#include "estimator/explain/verdict/verdict.hpp"
#include "estimator/model/study_effects.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::explain {
namespace {

/// The effects that the study's model has already, in its order, with their values.
void take_given(const Study& study, const rig::Session& session, SetSearchOptions& options) {
  for (rig::StatedEffect& stated : rig::stated_effects(study, session)) {
    options.values.insert(options.values.end(), stated.values.begin(), stated.values.end());
    options.terms.push_back({stated.effect, std::move(stated.change_points)});
  }
}

std::vector<Step> steps_of(const EffectSet& before, const EffectSet& after) {
  const auto reduced = [&](const EffectSet& set) {
    return set.evidence.left.cwiseAbs2().cwiseQuotient(after.evidence.variance).mean();
  };
  std::vector<Step> steps{{"base model", reduced(before)}};
  if (&before != &after) {
    std::string ids;
    for (const std::string& id : after.ids())
      ids += (ids.empty() ? "" : " + ") + id;
    steps.push_back({ids, reduced(after)});
  }
  return steps;
}

/// Where sets of one effect look alike, the port that most of them have, or the best one's; none if they have several
/// effects.
std::optional<std::string> common_port(const EffectLibrary& library, const Explanation& found) {
  std::map<std::string, size_t> votes;
  const auto vote = [&](const std::string& id, size_t weight) {
    votes[std::string(name_of(library.find(id)->text().port))] += weight;
  };
  if (found.effects.size() > 1) return {};
  for (const FoundEffect& best : found.effects)
    vote(best.id, 3);
  for (const std::vector<std::string>& ids : found.ambiguous_with) {
    if (ids.size() > 1) return {};
    if (ids.size() == 1) vote(ids.front(), 2);
  }
  if (votes.empty()) return {};
  return std::ranges::max_element(votes, {}, [](const auto& port) { return port.second; })->first;
}

std::optional<NextExperiment> next_experiment(const Study& study, const rig::SessionProblem& problem,
                                              const WeighedSets& search, const SetVerdict& verdict,
                                              const Explanation& found) {
  SpecimenKnowledge knowledge;
  if (const auto* annulus = std::get_if<AnnulusSpecimen>(&study.specimen))
    knowledge.inner_radius_mm = annulus->inner_radius_mm;
  const ExperimentDesign design{problem, limits_of(problem.session()), problem.threads(), knowledge};
  if (found.verdict == Verdict::unexplained)
    return found.where.empty() ? std::nullopt : exposing_experiment(design, found.where.front());
  const EffectSet& chosen = search.sets[verdict.chosen];
  if (found.verdict == Verdict::named) return sharpening_experiment(design, fitted_model(problem, chosen));
  // Ambiguous sets are separated from each other, a hint from nothing.
  std::vector<FittedModel> models{fitted_model(problem, chosen)};
  std::set<std::vector<std::string>> seen{chosen.ids()};
  for (const EffectSet& set : search.sets) {
    const bool rival = found.verdict == Verdict::ambiguous
                           ? std::ranges::count(found.ambiguous_with, set.ids()) > 0
                           : !found.hints.empty() && set.ids().empty() != chosen.ids().empty();
    // Of a set in rigs of several tolerances the most probable stands for it.
    if (rival && seen.insert(set.ids()).second) models.push_back(fitted_model(problem, set));
  }
  std::vector<const FittedModel*> competing;
  for (const FittedModel& model : models)
    competing.push_back(&model);
  return competing.size() > 1 ? separating_experiment(design, competing) : std::nullopt;
}

ModelErrorSize model_error_of(const rig::SessionProblem& problem, const EffectSet& set, bool from_reference) {
  constexpr double moved = 1.5;  // by which a share is another than the stated one
  const double share = set.evidence.shares[0] / problem.error().prior.share[0];
  const double rms_kPa = error_rms(problem, set.evidence.shares, rig::Signal::cavity);
  ModelErrorSize size{from_reference                         ? "reference"
                      : share > moved || share < 1.0 / moved ? "estimated"
                                                             : "stated",
                      1e3 * rms_kPa, 100.0 * rms_kPa / problem.error().range[0]};
  const rig::Shares beyond = set.evidence.surprise(problem.error().prior);
  const auto& groups = problem.error().group;
  for (size_t g = 0; g < rig::error_groups; ++g)
    if (std::ranges::count(groups, static_cast<rig::ErrorGroup>(g)) > 0)
      size.parts.push_back({std::string(name_of(static_cast<rig::ErrorGroup>(g))), beyond[g]});
  size.parts.push_back({"tolerances", largest_tolerance(problem, set)});
  return size;
}

/// Of offsets in sds those of one sd and more, the largest first.
std::vector<Departure> departures(const rig::SessionProblem& problem, const Eigen::VectorXd& offsets) {
  std::vector<Departure> list;
  for (size_t i = rig::basic_nuisances; i < problem.nuisances().size(); ++i) {
    const rig::Nuisance& part = problem.nuisances()[i];
    const double sds = offsets[static_cast<Eigen::Index>(i - rig::basic_nuisances)];
    if (std::abs(sds) >= 1.0) list.push_back({part.name, part.sd * sds, part.unit, sds});
  }
  std::ranges::sort(list, std::greater(), [](const Departure& part) { return std::abs(part.sds); });
  return list;
}

void require_known_tolerances(const rig::Session& session) {
  std::vector<std::string> known;
  for (const rig::Tolerance& tolerance : rig::all_tolerances())
    known.emplace_back(tolerance.name);
  for (const auto& [name, sd] : session.tolerance_sd)
    if (std::ranges::count(known, name) == 0)
      throw InputError({.file = session.runs.front().drive.place.name + ".run.h5",
                        .place = "attribute /rig tolerance_" + name,
                        .problem = "no part of the rig has this name",
                        .remedy = did_you_mean(name, known) +
                                  "Those that [rig.tolerance] of rig.toml may set are: " +
                                  fmt::format("{}.", fmt::join(known, ", "))});
}

/// The shares that the study states; what sets in or drifts goes with what repeats.
void state_error(const StudyModelError& stated, rig::Shares& share) {
  using enum rig::ErrorGroup;
  const auto state = [&](std::optional<double> percent, rig::ErrorGroup whole, rig::ErrorGroup transient) {
    if (!percent) return;
    const double factor = 0.01 * *percent / share[static_cast<size_t>(whole)];
    share[static_cast<size_t>(whole)] *= factor;
    if (transient != whole) share[static_cast<size_t>(transient)] *= factor;
  };
  state(stated.cavity_percent, cavity, cavity_transient);
  state(stated.pump_percent, pump, pump_transient);
  state(stated.volume_percent, volume, volume);
}

/// A sentence where the specimen as the study has it would show pressures that are beyond its modulus' prior.
std::string doubt_of_units(const rig::SessionProblem& problem) {
  constexpr double four_sds = 16.0;  // of what is known of the modulus
  rig::SessionModel stated;
  stated.nuisances = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.nuisances().size()));
  double shown_kPa = 0.0;
  for (size_t r = 0; r < problem.session().runs.size(); ++r) {
    const auto [least, most] = std::ranges::minmax(problem.predict_run(r, stated).pressures.cavity_kPa);
    shown_kPa = std::max(shown_kPa, most - least);
  }
  const double measured_kPa = problem.error().range[static_cast<size_t>(rig::Signal::cavity)];
  if (!(shown_kPa > four_sds * measured_kPa || measured_kPa > four_sds * shown_kPa)) return {};
  return fmt::format(
      " By the study the specimen would show {:.4g} kPa, and {:.4g} kPa were recorded: is its stiffness in "
      "kPa, and the "
      "transducer's kPa_per_V right?",
      shown_kPa, measured_kPa);
}

/// A sentence where the piston's motion is known roughly only.
std::string doubt_of_motion(const rig::Session& session) {
  std::string runs;
  double worst_mL = 0.0;
  for (const rig::SessionRun& run : session.runs) {
    if (run.smoothed_mL == 0.0) continue;
    runs += (runs.empty() ? "" : ", ") + run.drive.place.name;
    worst_mL = std::max(worst_mL, run.smoothed_mL);
  }
  if (runs.empty()) return {};
  return fmt::format(
      " No motion that is known follows the counted steps of {}: they were smoothed, and are up to {:.2g} mL "
      "off, which may look like an effect of the drive.",
      runs, worst_mL);
}

/// What its references say of the rig, and the problem with it.
ReferenceSummary take_reference(const Study& study, const Reference& reference,
                                rig::SessionProblem& problem) {
  require_rig_of(reference, problem.session(), study);
  use_reference(reference, problem);
  ReferenceSummary summary;
  summary.sessions = reference.sessions;
  for (size_t s = 0; s < rig::signal_count; ++s) {
    if (reference.rms[s] == 0.0) continue;
    const auto signal = static_cast<rig::Signal>(s);
    const double scale = signal == rig::Signal::volume ? 1.0 : 1e3;
    summary.channels.push_back(
        {std::string(rig::name_of(signal)), scale * reference.rms[s], reference.percent_of_range[s]});
  }
  summary.departures = departures(problem, problem.prior({}).mean);
  return summary;
}

bool is_something_found(const SetVerdict& verdict) {
  return verdict.verdict == Verdict::named || verdict.verdict == Verdict::ambiguous;
}

/// The one that was found; the rig without effects otherwise.
const EffectSet& explaining_set(const WeighedSets& search, const SetVerdict& verdict) {
  return search.sets[is_something_found(verdict) ? verdict.chosen : verdict.plain];
}

/// The verdict and what it rests on, as the explanation holds them.
Explanation described(const Study& study, const rig::SessionProblem& problem, const WeighedSets& search,
                      const SetVerdict& verdict, bool from_reference) {
  const EffectSet& plain = search.sets[verdict.plain];
  const bool is_found = is_something_found(verdict);
  const EffectSet& chosen = search.sets[verdict.chosen];
  const EffectSet& after = explaining_set(search, verdict);
  Explanation out;
  out.study = study.file.string();
  out.verdict = verdict.verdict;
  out.confidence = verdict.confidence;
  out.model_error = model_error_of(problem, chosen, from_reference);
  out.departures = departures(problem, problem.tolerances(chosen.model));
  for (const rig::CycleScatter& scatter : verdict.scatter)
    out.cycle_scatter.push_back(
        {std::string(rig::name_of(scatter.signal)), 1e3 * scatter.rms_kPa, 1e3 * scatter.noise_kPa,
         100.0 * scatter.rms_kPa / problem.error().range[static_cast<size_t>(scatter.signal)]});
  out.hints = verdict.hints;
  out.searches = verdict.searches;
  out.converged = is_settled(out.searches);
  out.ambiguous_with = verdict.ambiguous_with;
  if (is_found) out.effects = found_effects(problem, chosen, verdict);
  out.gap = held_out_gap(problem, plain, after);
  if (is_found) {
    out.where = misfits(problem, plain, chosen);
    if (const auto port = common_port(problem.session().effects, out);
        port && out.verdict == Verdict::ambiguous)
      for (Misfit& place : out.where)
        place.port = *port;
  } else if (out.verdict == Verdict::unexplained) {
    EffectSet expected = plain;
    expected.evidence.variance = problem.error().variance(problem.error().prior.share);
    out.where = misfits(problem, plain, expected);
  }
  if (verdict.tone) {
    const auto place = verdict.is_tone_alone ? out.where.begin() : out.where.end();
    out.where.insert(place, misfit_of(*verdict.tone, problem.session()));
  }
  out.evidence = candidates(problem.session().effects, search, verdict);
  if (!out.effects.empty()) out.shifts = parameter_shifts(problem, plain, chosen);
  out.steps = steps_of(plain, after);
  out.traces = traces(problem, plain, after);
  return out;
}

/// What may follow a verdict: a law that the library lacks, and the next experiment. Ctrl-C ends it and keeps the verdict.
void learn_and_propose(Explanation& out, const Study& study, const ExplainOptions& options,
                       const rig::SessionProblem& problem, const WeighedSets& search,
                       const SetVerdict& verdict, const ErrorKnowledge& error,
                       const std::function<void(std::string_view)>& report) {
  try {
    if (options.learn && out.verdict == Verdict::none) {
      out.not_learned = "nothing exceeds the model's own error";
    } else if (options.learn || (out.verdict == Verdict::unexplained && !verdict.is_tone_alone)) {
      out.not_learned = "it was interrupted";
      Learning learning = learn_term(problem, explaining_set(search, verdict), error, report);
      out.learned = std::move(learning.term);
      out.not_learned = std::move(learning.lacks);
    }
    report("designing the next experiment");
    if (options.propose) out.next_experiment = next_experiment(study, problem, search, verdict, out);
  } catch (const Interrupted&) {
    out.summary = "Interrupted after the verdict. ";
  }
}

}  // namespace

Explanation explain_rig(const Study& study, const ExplainOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  options.report("reading the runs");
  rig::Session session = rig::read_session(study);
  require_known_tolerances(session);
  const std::string set_aside = set_aside_learnt(study, session);
  rig::SpecimenFamily family(study);
  family.compute_ahead();
  const auto report = [&](std::string_view what) { options.report(std::string(what)); };
  std::optional<Reference> learnt;
  if (!study.data.reference.empty()) learnt = reference_of(study, options.threads, report);
  rig::SessionProblem problem(session, family, options.threads,
                              learnt ? learnt_tolerances(*learnt) : std::vector<std::string_view>{});
  state_error(study.model_error, problem.error().prior.share);
  std::optional<ReferenceSummary> reference;
  if (learnt) reference = take_reference(study, *learnt, problem);
  SetSearchOptions searching{.progress = report};
  take_given(study, session, searching);
  const WeighedSets search = search_sets(problem, searching);
  if (std::ranges::none_of(search.sets,
                           [&](const EffectSet& set) { return set.model.terms.size() == search.given; })) {
    throw InputError(
        {.file = study.file.string(),
         .place = "data.runs",
         .problem = "the rig's model has no solution for these runs",
         .remedy = "Check the runs' /rig and the specimen: `diastole inspect RUN` shows what was recorded."});
  }

  options.report("judging");
  const ErrorKnowledge error{learnt.has_value(),
                             learnt ? learnt->termination : inference::Termination::converged};
  const SetVerdict verdict = judge_sets(problem, search, error);
  Explanation out = described(study, problem, search, verdict, error.from_reference);
  out.reference = reference;
  learn_and_propose(out, study, options, problem, search, verdict, error, report);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  out.summary += summary_of(out) + set_aside + doubt_of_units(problem) + doubt_of_motion(session);
  if (verdict.tone)
    out.summary += fmt::format(
        " The cavity's pressure holds a tone near {:.1f} Hz, {:.0f} Pa RMS or more, that no cycle makes: "
        "is it the mains, a ventilator, a table that shakes?",
        verdict.tone->frequency_Hz, 1e3 * verdict.tone->rms_kPa);
  return out;
}

}  // namespace diastole::explain
