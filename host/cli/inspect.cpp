#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/cli/session_facts.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/contract/plain_text.hpp"
#include "protocol/contract/waiting_line.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/soundness.hpp"

namespace diastole {
namespace {

using nlohmann::json;

json stream_json(const runfile::StreamFacts& facts) {
  return {DIASTOLE_NAMED(facts, rows, missing, rate_Hz),
          {"samples", facts.rows - static_cast<size_t>(facts.missing)},
          {"expected", facts.expected ? json(*facts.expected) : json()},
          {"irregular_steps", facts.irregularity.steps},
          {"longest_step_ms", facts.irregularity.longest_ms}};
}

json attributes_json(const Attributes& attributes) {
  json object = json::object();
  for (const auto& [name, value] : attributes)
    std::visit([&, key = name](const auto& v) { object[key] = v; }, value);
  return object;
}

/// What /rig states about a channel's calibration: cavity_calibrated_utc of cavity_kPa, and so on.
Attributes calibration_of(const runfile::RecordedRun& run, const std::string& channel) {
  const std::string prefix = channel.substr(0, channel.rfind('_') + 1);
  Attributes calibration;
  for (const char* fact :
       {"kPa_per_V", "zero_V", "calibrated_utc", "calibrated_by", "zeroed_utc", "zeroed_by"}) {
    if (const auto found = run.rig.find(prefix + fact); found != run.rig.end())
      calibration[fact] = found->second;
  }
  return calibration;
}

/// Empty for a run that states nothing of it.
std::string calibration_words(const Attributes& calibration) {
  if (calibration.empty()) return {};
  const auto text = [&](const char* fact) {
    const auto found = calibration.find(fact);
    const auto* value = found == calibration.end() ? nullptr : std::get_if<std::string>(&found->second);
    return value == nullptr ? std::string() : *value;
  };
  const auto when = [&](const std::string& what) {
    const std::string by = text((what + "_by").c_str());
    return fmt::format("{} {}{}", what, text((what + "_utc").c_str()), by.empty() ? "" : " by " + by);
  };
  std::string words =
      text("calibrated_utc").empty() ? "not calibrated: the rig file's nominal scale" : when("calibrated");
  if (!text("zeroed_utc").empty()) words += ", " + when("zeroed");
  return words;
}

json slices_json(const runfile::RecordedRun& run) {
  json slices = json::array();
  for (const runfile::Slice& slice : run.slices) {
    slices.push_back({{"slice", slice.number},
                      DIASTOLE_NAMED(slice, block, first_trigger, triggers, cycles, dummy_cycles)});
  }
  return slices;
}

json as_json(const runfile::RecordedRun& run, const runfile::Soundness& soundness) {
  json document{{"run", run.file},
                DIASTOLE_NAMED(run, run_id, started_utc, producer, clock),
                DIASTOLE_NAMED(soundness, duration_s, scheduled_cycles, problems, stopped_on_request),
                {"triggers", run.trigger_s.size()},
                {"trigger_faults", {DIASTOLE_NAMED(soundness.triggers, missing, extra, non_periodic)}},
                {"slices", slices_json(run)},
                {"samples", soundness.pressure.rows - static_cast<size_t>(soundness.pressure.missing)},
                {"pressure", stream_json(soundness.pressure)},
                {"pump", stream_json(soundness.pump)},
                {"gaps", soundness.pressure.missing + soundness.pump.missing + run.missing("trigger")},
                {"gap_records", run.gaps.size()},
                {"events", run.events.size()},
                {"session", session_json(runfile::read_session(run.file))},
                {"sound", soundness.sound()}};
  document["channels"] = json::object();
  for (const auto& [name, range] : soundness.ranges) {
    document["channels"][name] = {{"min_kPa", range.any() ? json(range.least) : json()},
                                  {"max_kPa", range.any() ? json(range.most) : json()}};
    if (const auto saturated = soundness.saturated.find(name); saturated != soundness.saturated.end())
      document["channels"][name]["saturated"] = saturated->second;
    if (const auto notes = run.pressure.notes.find(name); notes != run.pressure.notes.end())
      document["channels"][name]["notes"] = attributes_json(notes->second);
    if (const auto calibration = calibration_of(run, name); !calibration.empty())
      document["channels"][name]["calibration"] = attributes_json(calibration);
  }
  document["segments"] = json::array();
  for (const runfile::Segment& segment : run.segments) {
    document["segments"].push_back(
        {DIASTOLE_NAMED(segment, start_s, waveform, stroke_mL, period_s, offset_mL, cycles)});
  }
  document["flow_segments"] = json::array();
  for (const auto& [segment, flow] : run.flow)
    document["flow_segments"].push_back(segment);
  return document;
}

std::string in_words(const runfile::StreamFacts& facts) {
  if (facts.rows == 0) return "no sample";
  std::string words =
      facts.rows == 1 ? "1 row" : fmt::format("{} rows at {:.2f} Hz", facts.rows, facts.rate_Hz);
  words += facts.any() ? fmt::format(", {} missing", facts.missing) : ", no sample: all are missing";
  if (facts.irregularity.steps > 0) {
    words += fmt::format("; irregular: {} steps longer than {:g} spacings, the longest {:.1f} ms{}",
                         facts.irregularity.steps, runfile::irregular_spacings, facts.irregularity.longest_ms,
                         facts.missing == 0 ? ", nothing missing" : "");
  }
  return words;
}

void show_channels(const runfile::RecordedRun& run, const runfile::Soundness& soundness) {
  for (const auto& [name, range] : soundness.ranges) {
    print_plain("    {}: {}\n", name,
                range.any() ? fmt::format("{:.3f} to {:.3f} kPa", range.least, range.most) : "no sample");
    if (const std::string words = calibration_words(calibration_of(run, name)); !words.empty())
      print_plain("      {}\n", words);
    const auto notes = run.pressure.notes.find(name);
    if (notes == run.pressure.notes.end()) continue;
    for (const auto& [note, value] : notes->second)
      std::visit([&, key = note](const auto& v) { print_plain("      {}: {}\n", key, v); }, value);
  }
}

void show_slices(const runfile::RecordedRun& run) {
  for (size_t i = 0; i < run.slices.size(); ++i) {
    const runfile::Slice& slice = run.slices[i];
    print_plain("  slice {} ({} {}): {} of {} cycles, triggers {} to {}\n", i, slice.block, slice.number,
                slice.triggers, slice.cycles, slice.first_trigger, slice.first_trigger + slice.triggers - 1);
  }
}

void show_triggers(const runfile::RecordedRun& run, const runfile::Soundness& soundness) {
  const std::string holds =
      soundness.scheduled_holds > 0 ? fmt::format(" and {} of hold", soundness.scheduled_holds) : "";
  const runfile::TriggerCounts& counts = soundness.triggers;
  print_plain("  triggers: {} for {} cycles{}; {} missing, {} extra, {} not periodic\n", run.trigger_s.size(),
              soundness.scheduled_cycles, holds, counts.missing, counts.extra, counts.non_periodic);
}

void show(const runfile::RecordedRun& run, const runfile::Soundness& soundness) {
  print_plain("{}\n  run {} of {}, by {}\n", run.file, run.run_id, run.started_utc, run.producer);
  print_plain("{}", session_words(runfile::read_session(run.file)));
  for (size_t i = 0; i < run.segments.size(); ++i) {
    const runfile::Segment& s = run.segments[i];
    print_plain("  segment {}: {} x {} of {:g} mL in {:g} s from {:.3f} s, offset {:g} mL{}\n", i, s.cycles,
                s.waveform, s.stroke_mL, s.period_s, s.start_s, s.offset_mL,
                run.flow.contains(i) ? ", with phase-contrast volumes" : "");
  }
  print_plain("  pressure: {}\n", in_words(soundness.pressure));
  show_channels(run, soundness);
  print_plain("  pump: {}\n", in_words(soundness.pump));
  show_triggers(run, soundness);
  show_slices(run);
  for (const auto& [name, value] : run.clock)
    print_plain("  clock {}: {:g}\n", name, value);
  for (const runfile::Event& event : run.events)
    print_plain("  {:.3f} s {} {}: {}\n", event.time_s, event.level, event.code, event.text);
  if (soundness.sound()) {
    print_plain("sound: nothing is missing{}\n",
                soundness.stopped_on_request ? "; the run was stopped on request" : "");
    return;
  }
  print_plain("not sound:\n");
  for (const std::string& problem : soundness.problems)
    print_plain("  {}\n", problem);
}

}  // namespace

void add_inspect(CommandLine& line) {
  auto file = std::make_shared<std::string>();
  CLI::App* command =
      line.add("inspect", "what is in a run file, and whether it is sound",
               "  diastole inspect gel.run.h5\n"
               "  diastole inspect gel.run.h5 --json | jq .sound\n"
               "Exit code 1: the file is whole, but the run is not sound (gaps, triggers, faults).");
  command->add_option("RUN", *file, "run file")->required();
  line.on_run(command, [file](const CommandOutput& out) {
    std::optional<WaitingLine> waiting(std::in_place, "reading " + *file);
    const auto [run, rows] = runfile::open_run(*file);
    const runfile::Soundness soundness = runfile::assess(run, rows);
    waiting.reset();
    print(out, as_json(run, soundness), [&, &known = run] { show(known, soundness); });
    return soundness.sound() ? ExitCode::done : ExitCode::negative;
  });
}

}  // namespace diastole
