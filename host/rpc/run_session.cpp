#include "host/rpc/run_session.hpp"

#include <fmt/format.h>
#include <chrono>
#include <filesystem>
#include <thread>

#include "host/config/experiment.hpp"
#include "host/journal/part_file.hpp"
#include "host/rpc/rig_json.hpp"
#include "host/runfile/output_guard.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole {
namespace {

using nlohmann::json;

/// The daemon keeps its own copy beside the journal; the user's appears whole or not at all.
void deliver(const std::filesystem::path& from, const std::filesystem::path& to) {
  remove_leftovers(to);
  try {
    copy_durably(from, to);
  } catch (const std::filesystem::filesystem_error& error) {
    throw HardwareError(to.string(), error.what(),
                        "The run is safe in " + from.string() + "; copy it from there.");
  }
}

json facts_json(const SessionFacts& facts) {
  json object = json::object();
  if (!facts.specimen.empty()) object[runfile::specimen_fact] = facts.specimen;
  if (!facts.operator_name.empty()) object[runfile::operator_fact] = facts.operator_name;
  if (facts.room_temperature_C) object[runfile::room_temperature_fact] = *facts.room_temperature_C;
  if (!facts.notes.empty()) object["notes"] = facts.notes;
  return object;
}

/// The command that makes the run file that was wanted.
std::string recovery(const std::string& journal, const SessionOptions& options) {
  return fmt::format("`diastole recover {} -o {}{}`", journal, options.output,
                     options.force ? " --force" : "");
}

SessionProgress progress_of(const json& state, size_t& remarks_seen) {
  SessionProgress progress{.planned_s = state.at("planned_s"),
                           .planned_cycles = state.at("planned_cycles"),
                           .triggers = state.at("triggers"),
                           .samples = state.at("received"),
                           .gaps = state.at("missing"),
                           .last_kPa = state.at("last_kPa"),
                           .filtered_kPa = state.at("filtered_kPa"),
                           .schedule = {},
                           .new_remarks = {}};
  if (const json& schedule = state.at("schedule"); !schedule.is_null())
    progress.schedule = schedule.get<ScheduleProgress>();
  for (const json& remark : state.at("remarks")) {
    if (const size_t number = remark.at("number"); number > remarks_seen) {
      progress.new_remarks.push_back(fmt::format(
          "warning: {} remarks came too fast to be shown; the daemon's log has them", number - remarks_seen));
    }
    remarks_seen = remark.at("number").get<size_t>() + 1;
    progress.new_remarks.push_back(
        fmt::format("{}: {}", remark.at("level").get<std::string>(), remark.at("text").get<std::string>()));
  }
  return progress;
}

/// Follows the run to its end and returns the daemon's result.
json follow_to_end(DaemonClient& daemon, const SessionOptions& options) {
  size_t remarks_seen = 0;
  int stops_sent = 0;
  while (true) {
    if (const int asked = std::min(2, options.stops_asked()); asked > stops_sent) {
      stops_sent = asked;
      daemon.call("run.stop", {{"how", asked == 1 ? "cycle_end" : "now"}});
    }
    const json state = daemon.call("run.progress", {{"first_remark", remarks_seen}});
    const SessionProgress progress = progress_of(state, remarks_seen);
    options.progress(progress);
    const bool ready = options.ready();  // also without a prompt: what was entered before it does not count
    if (ready && progress.schedule && !progress.schedule->prompt.empty()) {
      daemon.call("run.continue", {{"slice", progress.schedule->slice}});
    }
    const bool all_reported = state.at("remarks").empty();
    if (all_reported && (state.at("state") == "done" || state.at("state") == "failed"))
      return state.at("result");
    if (!all_reported) continue;
    std::this_thread::sleep_for(std::chrono::milliseconds(options.poll_ms));
  }
}

/// The same; when the daemon is lost on the way, says where the run is: `begun` is its answer to run.start.
json follow(DaemonClient& daemon, const SessionOptions& options, const json& begun, bool in_slices) {
  try {
    return follow_to_end(daemon, options);
  } catch (const HardwareError& error) {
    throw HardwareError(
        "run", fmt::format("lost sight of the daemon: {}", error.what()),
        fmt::format("If the daemon could end the run, it is in {}; otherwise make it of the journal: {}.{}",
                    begun.at("run_file").get<std::string>(),
                    recovery(begun.at("journal").get<std::string>(), options),
                    in_slices ? " `diastole run --resume` goes on with the next slice." : ""));
  }
}

}  // namespace

SessionResult run_session(DaemonClient& daemon, const SessionOptions& options) {
  const Experiment experiment = read_experiment(options.experiment);
  check_output(options.output, options.force, {options.experiment});
  json points = json::object();
  for (const ExperimentWaveform& waveform : experiment.waveforms)
    points[waveform.name] = waveform.points.text;
  const json begun = daemon.call("run.start", {{"experiment", experiment.text},
                                               {"file", experiment.file},
                                               {"points", points},
                                               {"prompts_answered", options.prompts_answered},
                                               {"resume", options.resume},
                                               {"session", facts_json(options.facts)}});
  const json result = follow(daemon, options, begun, experiment.schedule.has_value());
  if (!result.contains("run_file")) {
    throw HardwareError(
        "run", result.value("problem", "no run file could be made"),
        fmt::format("What was recorded is in its journal: {}.", recovery(result.at("journal"), options)));
  }
  deliver(result.at("run_file").get<std::string>(), options.output);
  return {options.output,      result.at("end"),      result.at("regular"),
          result.at("cycles"), result.at("triggers"), result.at("samples"),
          result.at("gaps"),   result.at("expected"), result.at("errors")};
}

}  // namespace diastole
