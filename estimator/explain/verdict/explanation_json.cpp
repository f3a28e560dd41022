#include "estimator/explain/verdict/explanation_json.hpp"

#include <cmath>
#include <utility>

#include "estimator/io/record_file.hpp"
#include "estimator/io/termination_json.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace explain {

DIASTOLE_MEMBERS(FoundParameter, value, unit, ci90, standard_error)

DIASTOLE_MEMBERS(FoundChangePoint, run, time_s)

template <class Visit, IsRecord<FoundEffect> Record>
void each_member(Visit&& visit, Record& effect) {
  visit("id", effect.id);
  visit("size_over_model_error", effect.size_over_model_error);
  visit("parameters", by_name(effect.parameters));
  visit("moments", effect.change_points);
}

DIASTOLE_MEMBERS(Hint, id, size_over_model_error, probability)

DIASTOLE_MEMBERS(ErrorPart, part, beyond_expected_sd)
DIASTOLE_MEMBERS(ModelErrorSize, source, rms_Pa, percent_of_range, parts)

DIASTOLE_MEMBERS(Departure, part, offset, unit, sds)

DIASTOLE_MEMBERS(CycleScatter, channel, rms_Pa, noise_Pa, percent_of_range)

DIASTOLE_MEMBERS(ReferenceMisfit, channel, rms, percent_of_range)
DIASTOLE_MEMBERS(ReferenceSummary, sessions, channels, departures)

DIASTOLE_MEMBERS(Misfit, port, run, channel, segment, phase, band_Hz, region, excess_chi2, p_value)

DIASTOLE_MEMBERS(Gap, before, after, floor, closed, held_out)

DIASTOLE_MEMBERS(Candidate, ids, chi_square_drop, refitted, parameters, held_out_drop, verdict)

DIASTOLE_MEMBERS(ParameterShift, name, before, before_error, after, after_error)

DIASTOLE_MEMBERS(LearnedRival, port, sets, variables, effect_file)
DIASTOLE_MEMBERS(LearnedTerm, port, sets, variables, variable_unit, unit, curve, band, closed_form, gap,
                 held_out_gain, readings, shifts, rivals, effect_file, toml)

DIASTOLE_MEMBERS(Trace, run, channel, unit, noise_sd, time_s, measured, before, after, cavity_mL, trigger_s)

DIASTOLE_MEMBERS(FieldResidual, place_mm, frame, before, after, per_mm)

DIASTOLE_MEMBERS(Step, added, reduced_chi_square)

DIASTOLE_MEMBERS(NextExperiment, toml, separates, predicted_separation_sigma, reason)

DIASTOLE_MEMBERS(SearchEnd, effects, termination, of_reference)

DIASTOLE_MEMBERS(Explanation, study, verdict, confidence, model_error, reference, departures, cycle_scatter,
                 hints, summary, converged, searches, effects, ambiguous_with, where, gap, learned,
                 not_learned, next_experiment, study_after, evidence, shifts, steps, traces, field, seconds)

}  // namespace explain

template <>
struct JsonWords<explain::Verdict> {
  static constexpr const char* kind = "verdict";
  static constexpr std::array all{explain::Verdict::named, explain::Verdict::ambiguous,
                                  explain::Verdict::unexplained, explain::Verdict::none};
  static constexpr auto word_of = explain::name_of;
};

namespace explain {
namespace {

constexpr RecordFormat format{explanation_file_mark, "an explanation",
                              "Give an explanation.json that `diastole explain STUDY -o DIR` wrote.", false};

void round_traces(std::vector<Trace>& traces) {
  const auto shorten = [](std::vector<double>& values) {
    for (double& value : values)
      value = std::round(value * 1e5) / 1e5;
  };
  for (Trace& trace : traces) {
    for (auto* values :
         {&trace.time_s, &trace.measured, &trace.before, &trace.after, &trace.cavity_mL, &trace.trigger_s})
      shorten(*values);
  }
}

void require_sound(const Explanation& explanation) {
  for (const Trace& trace : explanation.traces) {
    const size_t count = trace.time_s.size();
    if (trace.measured.size() != count || trace.before.size() != count || trace.after.size() != count ||
        (!trace.cavity_mL.empty() && trace.cavity_mL.size() != count))
      throw std::invalid_argument(
          fmt::format("key traces: the lists of {} of {} differ in length", trace.channel, trace.run));
  }
}

}  // namespace

std::string to_json(const Explanation& explanation) {
  Explanation rounded = explanation;
  round_traces(rounded.traces);
  Json json = format.document(written(rounded));
  for (Json& place : json["where"]) {
    if (place["region"] == "") place["region"] = nullptr;
  }
  // The bulk on single lines, what people read indented.
  const Json traces = std::exchange(json["traces"], Json::array());
  const Json field = std::exchange(json["field"], Json::array());
  std::string text = json_text(json, 1);
  const auto put = [&text](const std::string& key, const Json& bulk) {
    const std::string empty = "\"" + key + "\": []";
    text.replace(text.rfind(empty), empty.size(), "\"" + key + "\": " + json_text(bulk));
  };
  put("field", field);
  put("traces", traces);
  return text + "\n";
}

bool is_explanation(std::string_view text) { return format.marks(text); }

Explanation explanation_from_json(std::string_view text, const std::string& file) {
  Explanation explanation;
  format.read(text, file, [&](const Json& json) {
    read_json(json, explanation, MissingMembers::kept);
    for (const char* key : {"verdict", "effects", "where", "gap"})
      if (!json.contains(key)) throw MemberFault("is missing", key);
    require_sound(explanation);
  });
  return explanation;
}

}  // namespace explain
}  // namespace diastole
