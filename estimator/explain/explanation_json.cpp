#include "estimator/explain/explanation_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

using Json = nlohmann::ordered_json;

constexpr int newest_version = 1;

template <class T, class Struct>
concept Is = std::is_same_v<std::remove_const_t<T>, Struct>;

// One list of members a struct serves writing and reading: `visit(name, member)`.

template <class Visit>
void each_member(Visit&& visit, Is<FoundParameter> auto& p) {
  visit("value", p.value);
  visit("ci90", p.ci90);
  visit("standard_error", p.standard_error);
}

template <class Visit>
void each_member(Visit&& visit, Is<FoundMoment> auto& m) {
  visit("run", m.run);
  visit("time_s", m.time_s);
}

template <class Visit>
void each_member(Visit&& visit, Is<FoundEffect> auto& e) {
  visit("id", e.id);
  visit("parameters", e.parameters);
  visit("moments", e.moments);
}

template <class Visit>
void each_member(Visit&& visit, Is<Misfit> auto& m) {
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

template <class Visit>
void each_member(Visit&& visit, Is<Gap> auto& g) {
  visit("before", g.before);
  visit("after", g.after);
  visit("floor", g.floor);
  visit("closed", g.closed);
  visit("held_out", g.held_out);
}

template <class Visit>
void each_member(Visit&& visit, Is<Candidate> auto& c) {
  visit("ids", c.ids);
  visit("chi_square_drop", c.chi_square_drop);
  visit("refitted", c.refitted);
  visit("parameters", c.parameters);
  visit("held_out_drop", c.held_out_drop);
  visit("verdict", c.verdict);
}

template <class Visit>
void each_member(Visit&& visit, Is<ParameterShift> auto& s) {
  visit("name", s.name);
  visit("before", s.before);
  visit("before_error", s.before_error);
  visit("after", s.after);
  visit("after_error", s.after_error);
}

template <class Visit>
void each_member(Visit&& visit, Is<Trace> auto& t) {
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

template <class Visit>
void each_member(Visit&& visit, Is<FieldResidual> auto& r) {
  visit("place_mm", r.place_mm);
  visit("frame", r.frame);
  visit("before", r.before);
  visit("after", r.after);
}

template <class Visit>
void each_member(Visit&& visit, Is<Step> auto& s) {
  visit("added", s.added);
  visit("reduced_chi_square", s.reduced_chi_square);
}

template <class Visit>
void each_member(Visit&& visit, Is<NextExperiment> auto& n) {
  visit("toml", n.toml);
  visit("separates", n.separates);
  visit("predicted_separation_sigma", n.predicted_separation_sigma);
  visit("reason", n.reason);
}

template <class Visit>
void each_member(Visit&& visit, Is<Explanation> auto& e) {
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

template <class T>
concept HasMembers = requires(T& value) {
  each_member([](const char*, auto&) {}, value);
};

Json written(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json written(const std::string& value) { return value; }
Json written(Verdict value) { return name_of(value); }
template <class Whole>
requires std::is_integral_v<Whole> Json written(Whole value) { return value; }
template <HasMembers T>
Json written(const T& value);
template <class T>
Json written(const std::optional<T>& value);
template <class T, size_t Count>
Json written(const std::array<T, Count>& list);
template <class T>
Json written(const std::vector<T>& list) {
  Json json = Json::array();
  for (const auto& value : list)
    json.push_back(written(value));
  return json;
}
Json written(const std::vector<FoundParameter>& parameters) {
  Json json = Json::object();
  for (const FoundParameter& parameter : parameters)
    json[parameter.name] = written<FoundParameter>(parameter);
  return json;
}
template <class T>
Json written(const std::optional<T>& value) {
  return value ? written(*value) : Json(nullptr);
}
template <class T, size_t Count>
Json written(const std::array<T, Count>& list) {
  Json json = Json::array();
  for (const T& value : list)
    json.push_back(written(value));
  return json;
}
template <HasMembers T>
Json written(const T& value) {
  Json json = Json::object();
  each_member([&](const char* name, const auto& member) { json[name] = written(member); }, value);
  return json;
}

void read(const Json& json, double& value) {
  value = json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}
void read(const Json& json, std::string& value) { value = json.is_null() ? "" : json.get<std::string>(); }
void read(const Json& json, bool& value) { value = json.get<bool>(); }
void read(const Json& json, Verdict& value) {
  const auto word = json.get<std::string>();
  for (const Verdict verdict : {Verdict::named, Verdict::ambiguous, Verdict::unexplained, Verdict::none}) {
    if (name_of(verdict) == word) return void(value = verdict);
  }
  throw std::invalid_argument("\"" + word + "\" is no verdict");
}
template <class Whole>
requires std::is_integral_v<Whole>
void read(const Json& json, Whole& value) {
  if (!json.is_number_integer() || !std::in_range<Whole>(json.get<int64_t>()))
    throw std::invalid_argument(json.dump() + " is no whole number in range");
  value = static_cast<Whole>(json.get<int64_t>());
}
template <HasMembers T>
void read(const Json& json, T& value);
template <class T>
void read(const Json& json, std::optional<T>& value);
template <class T, size_t Count>
void read(const Json& json, std::array<T, Count>& list) {
  if (!json.is_array() || json.size() != Count) throw std::invalid_argument("is a list of another length");
  for (size_t i = 0; i < Count; ++i)
    read(json[i], list[i]);
}
template <class T>
void read(const Json& json, std::vector<T>& list) {
  if (!json.is_array()) throw std::invalid_argument("is no list");
  list.clear();
  for (const Json& value : json)
    read(value, list.emplace_back());
}
void read(const Json& json, std::vector<FoundParameter>& parameters) {
  if (!json.is_object()) throw std::invalid_argument("is no object of parameters");
  parameters.clear();
  for (const auto& [name, value] : json.items()) {
    parameters.emplace_back().name = name;
    read<FoundParameter>(value, parameters.back());
  }
}
template <class T>
void read(const Json& json, std::optional<T>& value) {
  if (json.is_null()) return value.reset();
  read(json, value.emplace());
}
template <HasMembers T>
void read(const Json& json, T& value) {
  if (!json.is_object()) throw std::invalid_argument("is no object");
  each_member(
      [&](const char* name, auto& member) {
        if (!json.contains(name)) return;
        try {
          read(json.at(name), member);
        } catch (const nlohmann::json::exception& error) {
          throw std::invalid_argument(fmt::format("key {}: {}", name, error.what()));
        } catch (const std::invalid_argument& error) {
          throw std::invalid_argument(fmt::format("key {}: {}", name, error.what()));
        }
      },
      value);
}

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
    read(json, explanation);
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

}  // namespace diastole::explain
