#include "tools/diastole/compare/differences.hpp"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "estimator/io/fingerprint.hpp"

namespace diastole::comparison {
namespace {

using runfile::Attribute;
using runfile::RecordedRun;
using runfile::RunFile;
using runfile::Segment;
using Facts = std::map<std::string, Attribute, std::less<>>;

std::string in_words(const Attribute& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

/// Adds a difference unless all values are equal.
void add(Comparison& comparison, const std::string& group, const std::string& place,
         std::vector<std::string> values) {
  const bool same =
      std::ranges::all_of(values, [&](const std::string& value) { return value == values.front(); });
  if (!same) comparison.differences.push_back({group, place, std::move(values)});
}

void add_facts(Comparison& comparison, const std::vector<const Facts*>& facts,
               const std::function<std::string(const std::string&)>& group_of) {
  std::set<std::string> names;
  for (const Facts* of_run : facts)
    for (const auto& [name, value] : *of_run)
      names.insert(name);
  for (const std::string& name : names) {
    std::vector<std::string> values;
    for (const Facts* of_run : facts) {
      const auto found = of_run->find(name);
      values.push_back(found == of_run->end() ? "" : in_words(found->second));
    }
    add(comparison, group_of(name), name, std::move(values));
  }
}

/// What `diastole calibrate` and `diastole zero` determine of a channel.
bool is_calibration(const std::string& name) {
  return std::ranges::any_of(
      std::array{"_kPa_per_V", "_zero_V", "_calibrated_utc", "_calibrated_by", "_zeroed_utc", "_zeroed_by"},
      [&](const char* ending) { return name.ends_with(ending); });
}

/// Keys of an experiment whose values stand in other datasets of the run as well.
bool is_recorded_otherwise(const std::string& place) {
  static const std::regex keys(
      R"(trigger_delay_ms|segment\[\d+\]\.(waveform|stroke_mL|period_s|offset_mL|cycles))");
  return std::regex_match(place, keys);
}

/// Adds "schedule.block[0].slices" and the like.
void add_stated(const toml::node& node, const std::string& place, Facts& facts) {
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table)
      add_stated(value, (place.empty() ? "" : place + ".") + std::string(key.str()), facts);
  } else if (const toml::array* array = node.as_array()) {
    for (size_t i = 0; i < array->size(); ++i)
      add_stated((*array)[i], fmt::format("{}[{}]", place, i), facts);
  } else if (!is_recorded_otherwise(place)) {
    std::ostringstream text;
    text << toml::node_view(node);
    const auto number = node.value<double>();
    facts[place] = number ? Attribute(*number) : Attribute(node.value_or(text.str()));
  }
}

/// What an experiment file states besides that.
Facts stated_in(const std::string& experiment) {
  Facts facts;
  try {
    add_stated(toml::parse(experiment), "", facts);
  } catch (const toml::parse_error&) {
    facts["/protocol/toml"] = fmt::format("no TOML, fingerprint {}", fingerprint_of(experiment));
  }
  return facts;
}

/// The points that the controller followed in an uploaded segment.
std::string played_words(const RecordedRun& run, size_t segment) {
  const auto found = run.waveforms.find(segment);
  if (found == run.waveforms.end()) return {};
  const auto& [points, phase, fraction] = found->second;
  Fingerprint print;
  for (const std::vector<double>* values : {&phase, &fraction})
    print.add({reinterpret_cast<const char*>(values->data()), values->size() * sizeof(double)});
  const auto peak = static_cast<size_t>(std::ranges::max_element(fraction) - fraction.begin());
  return fmt::format("{} points, peak at {:.4g} of the period, fingerprint {}", fraction.size(),
                     peak < phase.size() ? phase[peak] : 0, print.text());
}

void add_protocol(Comparison& comparison, const std::vector<RunFile>& runs) {
  const auto add_of_runs = [&](const std::string& place, const auto& value_of) {
    std::vector<std::string> values;
    for (const RunFile& file : runs)
      values.push_back(value_of(file.run));
    add(comparison, "protocol", place, std::move(values));
  };
  add_of_runs("segments", [](const RecordedRun& run) { return fmt::format("{}", run.segments.size()); });
  size_t most = 0;
  for (const RunFile& file : runs)
    most = std::max(most, file.run.segments.size());
  for (size_t i = 0; i < most; ++i) {
    const auto add_member = [&](const char* name, const auto& member) {
      add_of_runs(fmt::format("segment {} {}", i, name), [&](const RecordedRun& run) {
        return i < run.segments.size() ? fmt::format("{}", run.segments[i].*member) : std::string();
      });
    };
    add_member("waveform", &Segment::waveform);
    add_member("stroke_mL", &Segment::stroke_mL);
    add_member("period_s", &Segment::period_s);
    add_member("offset_mL", &Segment::offset_mL);
    add_member("cycles", &Segment::cycles);
    add_of_runs(fmt::format("segment {} played", i),
                [&](const RecordedRun& run) { return played_words(run, i); });
  }
  add_of_runs("trigger delay_s",
              [](const RecordedRun& run) { return fmt::format("{}", run.trigger_delay_s); });
  add_of_runs("slices", [](const RecordedRun& run) { return fmt::format("{}", run.slices.size()); });
  std::vector<Facts> of_experiments;
  std::vector<const Facts*> experiments;
  for (const RunFile& file : runs)
    of_experiments.push_back(stated_in(file.run.protocol_toml));
  for (const Facts& facts : of_experiments)
    experiments.push_back(&facts);
  add_facts(comparison, experiments, [](const std::string&) { return "protocol"; });
}

}  // namespace

void add_differences(Comparison& comparison, const std::vector<RunFile>& runs,
                     const std::vector<runfile::Session>& sessions) {
  std::vector<const Facts*> of_sessions, of_rigs;
  for (const RunFile& file : runs)
    of_rigs.push_back(&file.run.rig);
  for (const runfile::Session& session : sessions)
    of_sessions.push_back(&session.facts);
  add_facts(comparison, of_sessions, [](const std::string&) { return "session"; });
  add_protocol(comparison, runs);
  add_facts(comparison, of_rigs,
            [](const std::string& name) { return is_calibration(name) ? "calibration" : "rig"; });
}

}  // namespace diastole::comparison
