#include "estimator/explain/verdict/explanation_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "estimator/io/member_json.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace explain {

template <class Visit, IsRecord<FoundParameter> Record>
void each_member(Visit&& visit, Record& p) {
  visit("value", p.value);
  visit("ci90", p.ci90);
  visit("standard_error", p.standard_error);
}

template <class Visit, IsRecord<FoundMoment> Record>
void each_member(Visit&& visit, Record& m) {
  visit("run", m.run);
  visit("time_s", m.time_s);
}

template <class Visit, IsRecord<FoundEffect> Record>
void each_member(Visit&& visit, Record& e) {
  visit("id", e.id);
  visit("parameters", e.parameters);
  visit("moments", e.moments);
}

template <class Visit, IsRecord<Misfit> Record>
void each_member(Visit&& visit, Record& m) {
  visit("port", m.port);
  visit("run", m.run);
  visit("channel", m.channel);
  visit("segment", m.segment);
  visit("phase", m.phase);
  visit("band_Hz", m.band_Hz);
  visit("region", m.region);
  visit("excess_chi2", m.excess_chi2);
  visit("p_value", m.p_value);
}

template <class Visit, IsRecord<Gap> Record>
void each_member(Visit&& visit, Record& g) {
  visit("before", g.before);
  visit("after", g.after);
  visit("floor", g.floor);
  visit("closed", g.closed);
  visit("held_out", g.held_out);
}

template <class Visit, IsRecord<Candidate> Record>
void each_member(Visit&& visit, Record& c) {
  visit("ids", c.ids);
  visit("chi_square_drop", c.chi_square_drop);
  visit("refitted", c.refitted);
  visit("parameters", c.parameters);
  visit("held_out_drop", c.held_out_drop);
  visit("verdict", c.verdict);
}

template <class Visit, IsRecord<ParameterShift> Record>
void each_member(Visit&& visit, Record& s) {
  visit("name", s.name);
  visit("before", s.before);
  visit("before_error", s.before_error);
  visit("after", s.after);
  visit("after_error", s.after_error);
}

template <class Visit, IsRecord<Trace> Record>
void each_member(Visit&& visit, Record& t) {
  visit("run", t.run);
  visit("channel", t.channel);
  visit("unit", t.unit);
  visit("noise_sd", t.noise_sd);
  visit("time_s", t.time_s);
  visit("measured", t.measured);
  visit("before", t.before);
  visit("after", t.after);
  visit("cavity_mL", t.cavity_mL);
  visit("trigger_s", t.trigger_s);
}

template <class Visit, IsRecord<FieldResidual> Record>
void each_member(Visit&& visit, Record& r) {
  visit("place_mm", r.place_mm);
  visit("frame", r.frame);
  visit("before", r.before);
  visit("after", r.after);
  visit("per_mm", r.per_mm);
}

template <class Visit, IsRecord<Step> Record>
void each_member(Visit&& visit, Record& s) {
  visit("added", s.added);
  visit("reduced_chi_square", s.reduced_chi_square);
}

template <class Visit, IsRecord<NextExperiment> Record>
void each_member(Visit&& visit, Record& n) {
  visit("toml", n.toml);
  visit("separates", n.separates);
  visit("predicted_separation_sigma", n.predicted_separation_sigma);
  visit("reason", n.reason);
}

template <class Visit, IsRecord<Explanation> Record>
void each_member(Visit&& visit, Record& e) {
  visit("study", e.study);
  visit("verdict", e.verdict);
  visit("summary", e.summary);
  visit("effects", e.effects);
  visit("ambiguous_with", e.ambiguous_with);
  visit("where", e.where);
  visit("gap", e.gap);
  visit("next_experiment", e.next_experiment);
  visit("study_after", e.study_after);
  visit("evidence", e.evidence);
  visit("shifts", e.shifts);
  visit("steps", e.steps);
  visit("traces", e.traces);
  visit("field", e.field);
  visit("seconds", e.seconds);
}

}  // namespace explain

template <>
struct JsonForm<explain::Verdict> {
  static nlohmann::ordered_json written(explain::Verdict verdict) { return name_of(verdict); }
  static void read(const nlohmann::ordered_json& json, explain::Verdict& verdict) {
    using explain::Verdict;
    const auto word = json.get<std::string>();
    for (const Verdict known : {Verdict::named, Verdict::ambiguous, Verdict::unexplained, Verdict::none}) {
      if (name_of(known) == word) return void(verdict = known);
    }
    throw std::invalid_argument("\"" + word + "\" is no verdict");
  }
};

// An object with the parameters' names as keys.
template <>
struct JsonForm<std::vector<explain::FoundParameter>> {
  static nlohmann::ordered_json written(const std::vector<explain::FoundParameter>& parameters) {
    auto json = nlohmann::ordered_json::object();
    for (const explain::FoundParameter& parameter : parameters)
      json[parameter.name] = diastole::written(parameter);
    return json;
  }
  static void read(const nlohmann::ordered_json& json, std::vector<explain::FoundParameter>& parameters) {
    if (!json.is_object()) throw std::invalid_argument("is no object of parameters");
    parameters.clear();
    for (const auto& [name, value] : json.items()) {
      parameters.emplace_back().name = name;
      read_json(value, parameters.back(), MissingMembers::kept);
    }
  }
};

namespace explain {
namespace {

using Json = nlohmann::ordered_json;

constexpr int newest_version = 1;

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
  Json json = {{"format", explanation_file_mark}, {"format_version", newest_version}};
  json.update(written(rounded));
  for (Json& place : json["where"]) {
    if (place["region"] == "") place["region"] = nullptr;
  }
  // The bulk on single lines, what people read indented.
  const Json traces = std::exchange(json["traces"], Json::array());
  const Json field = std::exchange(json["field"], Json::array());
  std::string text = json.dump(1);
  const auto put = [&text](const std::string& key, const Json& bulk) {
    const std::string empty = "\"" + key + "\": []";
    text.replace(text.rfind(empty), empty.size(), "\"" + key + "\": " + bulk.dump());
  };
  put("field", field);
  put("traces", traces);
  return text + "\n";
}

bool is_explanation(std::string_view text) {
  constexpr size_t head = 200;
  return text.substr(0, head).find(explanation_file_mark) != std::string_view::npos;
}

Explanation explanation_from_json(std::string_view text, const std::string& file) {
  const std::string remedy = "Give an explanation.json that `diastole explain STUDY -o DIR` wrote.";
  try {
    const Json json = Json::parse(text);
    if (json.is_object() && json.value("format_version", newest_version) > newest_version) {
      throw InputError({file, "key format_version",
                        fmt::format("version {} is newer than this program knows ({})",
                                    json.at("format_version").dump(), newest_version),
                        "Update the program."});
    }
    Explanation explanation;
    read_json(json, explanation, MissingMembers::kept);
    for (const char* key : {"verdict", "effects", "where", "gap"})
      if (!json.contains(key)) throw std::invalid_argument(fmt::format("has no key {}", key));
    require_sound(explanation);
    return explanation;
  } catch (const nlohmann::json::exception& error) {
    throw InputError({file, "", fmt::format("is not an explanation: {}", error.what()), remedy});
  } catch (const std::invalid_argument& error) {
    throw InputError({file, "", fmt::format("is not an explanation: {}", error.what()), remedy});
  }
}

}  // namespace explain
}  // namespace diastole
