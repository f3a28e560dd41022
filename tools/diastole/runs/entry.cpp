#include "tools/diastole/runs/entry.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string_view>

#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/runfile/h5_source.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/session.hpp"
#include "protocol/runfile/soundness.hpp"

namespace diastole::catalogue {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// As many as a thumbnail has pixels to show them with.
constexpr size_t trace_parts = 96;
/// Of a record's beginning: its format's name stands there.
constexpr size_t head_bytes = 200;

std::string relative_to(const fs::path& folder, const fs::path& file) {
  return file.lexically_relative(folder).generic_string();
}

std::string protocol_words(const std::vector<runfile::Segment>& segments) {
  std::vector<std::string> words;
  for (const runfile::Segment& segment : segments) {
    words.push_back(segment.waveform == "hold"
                        ? fmt::format("hold {:g} s", segment.end_s() - segment.start_s)
                        : fmt::format("{} x {} {:g} mL in {:g} s", segment.cycles, segment.waveform,
                                      segment.stroke_mL, segment.period_s));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// Least and largest of each part; a part without a sample has NaN.
std::vector<float> envelope(const runfile::Series& values_kPa) {
  const size_t parts = std::min(trace_parts, values_kPa.size());
  std::vector<float> pairs(2 * parts, std::numeric_limits<float>::quiet_NaN());
  size_t part = 0;
  values_kPa.each_block([&](size_t first, std::span<const double> block) {
    for (size_t i = 0; i < block.size(); ++i) {
      while ((part + 1) * values_kPa.size() / parts <= first + i)
        ++part;
      const auto value_kPa = static_cast<float>(block[i]);
      pairs[2 * part] = std::fmin(pairs[2 * part], value_kPa);
      pairs[2 * part + 1] = std::fmax(pairs[2 * part + 1], value_kPa);
    }
  });
  return pairs;
}

void read_run_into(Entry& entry, const fs::path& file) {
  const runfile::H5Source source(file);
  const auto [run, rows] = runfile::open_run(source);
  const runfile::Soundness soundness = runfile::assess(run, rows);
  const runfile::Session session = runfile::read_session(source);
  entry.date = run.started_utc;
  entry.specimen = session.text(runfile::specimen_fact);
  entry.operator_name = session.text(runfile::operator_fact);
  entry.room_temperature_C = session.number(runfile::room_temperature_fact);
  entry.protocol = protocol_words(run.segments);
  entry.duration_s = soundness.duration_s;
  entry.cycles = soundness.scheduled_cycles;
  entry.sound = soundness.sound();
  if (!soundness.sound()) entry.problem = soundness.problems.front();
  for (const runfile::SessionNote& note : session.notes)
    entry.notes += (entry.notes.empty() ? "" : "\n") + note.text;
  const bool is_filtered = rows.pressure.values.contains(runfile::cavity_filtered_channel);
  const std::string shown = is_filtered ? runfile::cavity_filtered_channel : runfile::cavity_channel;
  entry.trace = envelope(rows.pressure.values.at(shown));
  if (const runfile::Range& range = soundness.ranges.at(shown); range.any()) entry.peak_kPa = range.most;
}

/// A record without its bulk.
json record_of(const fs::path& file) {
  static const std::set<std::string, std::less<>> bulk{"traces", "field", "sections", "history", "residuals"};
  bool skips = false;
  return json::parse(read_whole_file(file), [&](int depth, json::parse_event_t event, json& parsed) {
    if (depth > deepest_json) throw JsonTooDeep(deepest_json);
    if (event == json::parse_event_t::key && depth == 1)
      skips = bulk.contains(parsed.get_ref<const std::string&>());
    return !(skips && depth > 0 && event != json::parse_event_t::object_end);
  });
}

std::optional<double> number_in(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

/// The study that a record names: a path from where the command was given, which nobody knows any more. So it is looked for
/// from the record's folder upwards, by its whole path and by its name.
std::optional<fs::path> find_study(const fs::path& folder, const fs::path& record, const fs::path& named) {
  if (named.empty()) return std::nullopt;
  if (named.is_absolute()) return fs::is_regular_file(named) ? std::optional(named) : std::nullopt;
  for (fs::path place = record.parent_path();; place = place.parent_path()) {
    for (const fs::path& tried : {place / named, place / named.filename()})
      if (fs::is_regular_file(tried)) return tried;
    if (place == folder || !place.has_relative_path()) return std::nullopt;
  }
}

/// What is no study has no runs here: the commands that use it say what is wrong with it.
std::vector<std::string> runs_of(const fs::path& folder, const fs::path& study) {
  std::vector<std::string> runs;
  try {
    const toml::table table = toml::parse(read_bounded_file(study, most_settings_bytes));
    const toml::array* listed = table["data"]["runs"].as_array();
    if (listed == nullptr) return runs;
    for (const toml::node& run : *listed) {
      if (const auto name = run.value<std::string>())
        runs.push_back(relative_to(folder, (study.parent_path() / *name).lexically_normal()));
    }
  } catch (const toml::parse_error&) {
    runs.clear();
  } catch (const InputError&) {
    runs.clear();
  }
  return runs;
}

void read_fit_into(Entry& entry, const json& record) {
  for (const auto& [name, parameter] : record.at("parameters").items()) {
    if (!name.ends_with("_kPa")) continue;
    entry.parameter = name;
    entry.stiffness_kPa = number_in(parameter, "value");
    entry.stiffness_se_kPa = number_in(parameter, "se");
    return;
  }
}

void read_explanation_into(Entry& entry, const json& record) {
  entry.verdict = record.at("verdict").get<std::string>();
  std::vector<std::string> ids;
  for (const json& effect : record.at("effects"))
    ids.push_back(effect.at("id"));
  entry.effects = fmt::format("{}", fmt::join(ids, ", "));
  for (const json& shift : record.value("shifts", json::array())) {
    if (!shift.at("name").get_ref<const std::string&>().ends_with("_kPa")) continue;
    entry.parameter = shift.at("name");
    entry.stiffness_kPa = number_in(shift, "after");
    entry.stiffness_se_kPa = number_in(shift, "after_error");
    return;
  }
}

std::string head_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string head(head_bytes, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<size_t>(std::max<std::streamsize>(0, stream.gcount())));
  return head;
}

std::optional<Entry> read_record(const fs::path& folder, const fs::path& file) {
  const std::string head = head_of(file);
  const bool is_fit = head.find(fit_file_mark) != std::string::npos;
  if (!is_fit && !explain::is_explanation(head)) return std::nullopt;
  Entry entry{.path = relative_to(folder, file), .kind = is_fit ? "fit" : "explanation"};
  try {
    const json record = record_of(file);
    is_fit ? read_fit_into(entry, record) : read_explanation_into(entry, record);
    for (const char* key : {"study_after", "study"}) {
      const auto study = find_study(folder, file, record.value(key, ""));
      if (study && entry.runs.empty()) entry.runs = runs_of(folder, *study);
    }
  } catch (const std::exception& error) {  // JSON that is cut off or of another form
    entry.problem = error.what();
  }
  return entry;
}

}  // namespace

Candidate candidate_of(const fs::path& file) {
  const std::string name = file.filename().string();
  if (name.ends_with(".h5")) return Candidate::run;
  return name.ends_with(".json") ? Candidate::record : Candidate::none;
}

std::string utc_text(int64_t mtime_ns) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                     fmt::gmtime(static_cast<std::time_t>(mtime_ns / 1'000'000'000)));
}

std::optional<Entry> read_entry(const fs::path& folder, const fs::path& file) {
  if (candidate_of(file) == Candidate::record) return read_record(folder, file);
  if (candidate_of(file) != Candidate::run) return std::nullopt;
  Entry entry{.path = relative_to(folder, file), .kind = "run"};
  try {
    read_run_into(entry, file);
  } catch (const InputError& error) {
    entry.sound = false;
    entry.problem = error.fault().place.empty() ? error.fault().problem
                                                : error.fault().place + " " + error.fault().problem;
  }
  return entry;
}

Entry images_entry(const fs::path& folder, const fs::path& images, int64_t files, int64_t newest_mtime_ns) {
  Entry entry{.path = relative_to(folder, images), .kind = "images", .date = utc_text(newest_mtime_ns)};
  entry.protocol = fmt::format("{} DICOM files", files);
  return entry;
}

}  // namespace diastole::catalogue
