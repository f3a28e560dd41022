#include "estimator/model/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <sstream>
#include <string>

#include "estimator/model/study_effects.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::rig {
namespace {

using runfile::RecordedRun;

double attribute(const RecordedRun& run, std::string_view name, double otherwise) {
  const auto found = run.rig.find(name);
  if (found == run.rig.end()) return otherwise;
  if (const auto* number = std::get_if<double>(&found->second)) return *number;
  if (const auto* whole = std::get_if<int64_t>(&found->second)) return static_cast<double>(*whole);
  return otherwise;
}

/// Seconds of an ISO 8601 time, from any fixed origin; NaN if it is none.
double seconds_of(const std::string& utc) {
  int year = 0;
  unsigned month = 0;
  unsigned day = 0;
  int hour = 0;
  int minute = 0;
  double second = 0.0;
  char mark = 0;
  std::istringstream text(utc);
  char dash = 0;
  text >> year >> dash >> month >> dash >> day >> mark >> hour >> dash >> minute >> dash >> second;
  if (text.fail()) return std::numeric_limits<double>::quiet_NaN();
  const std::chrono::sys_days days =
      std::chrono::year(year) / std::chrono::month(month) / std::chrono::day(day);
  return static_cast<double>(days.time_since_epoch().count()) * 86400.0 + hour * 3600.0 + minute * 60.0 +
         second;
}

std::string short_name(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  return name.substr(0, name.find(".run.h5"));
}

std::vector<GatedVolume> volumes_of(const RecordedRun& run) {
  std::vector<GatedVolume> volumes;
  for (const auto& [number, flow] : run.flow) {
    if (number >= run.segments.size()) continue;
    const runfile::Segment& segment = run.segments[number];
    GatedVolume volume{{}, flow};
    for (const double trigger : run.trigger_s) {
      const double start = trigger - run.trigger_delay_s;
      if (start > segment.start_s - 0.5 * segment.period_s &&
          start < segment.end_s() - 0.5 * segment.period_s)
        volume.trigger_s.push_back(trigger);
    }
    if (!volume.trigger_s.empty()) volumes.push_back(std::move(volume));
  }
  return volumes;
}

SessionRun session_run(RecordedRun&& run, const std::string& name) {
  SessionRun read;
  const FoundMotion found = find_motion(run);
  read.drive.motion = found.motion;
  if (!found.explained) read.smoothed_mL = found.worst_mL;
  read.drive.start_s = run.pressure.time_s.front();
  read.drive.end_s = run.pressure.time_s.back();
  read.drive.place.name = name;
  read.run_id = run.run_id;
  read.drive.place.started_s = seconds_of(run.started_utc);
  read.drive.place.trigger_s = run.trigger_s;
  read.drive.place.atmosphere_kPa = attribute(run, "atmospheric_kPa", 101.325);
  const double steps_a_turn = attribute(run, "microsteps", 0) * attribute(run, "steps_per_rev", 0);
  if (const double turn_mL = steps_a_turn * attribute(run, "volume_per_step_mL", 0); turn_mL > 0)
    read.drive.place.turn_mL = turn_mL;
  read.volumes = volumes_of(run);
  read.segments = run.segments;
  for (const runfile::Segment& segment : run.segments)
    if (segment.cycles > 1)
      read.drive.repetitions.push_back(
          {segment.start_s, segment.period_s, static_cast<size_t>(segment.cycles)});
  for (const Channel channel : {Channel::cavity, Channel::pump}) {
    const auto samples = run.pressure.channels.find(name_of(channel));
    if (samples != run.pressure.channels.end()) read.pressure_kPa[channel] = std::move(samples->second);
  }
  read.sample_s = std::move(run.pressure.time_s);
  return read;
}

/// What earlier runs of the session did to the specimen.
void set_history(Session& session) {
  for (SessionRun& run : session.runs) {
    RunPlace& place = run.drive.place;
    for (const SessionRun& other : session.runs) {
      if (other.drive.place.started_s >= place.started_s) continue;
      place.cycles_before += static_cast<double>(other.drive.place.trigger_s.size());
      for (const Stroke& stroke : other.drive.motion.strokes())
        place.largest_before_mL = std::max(place.largest_before_mL, stroke.to_mL);
    }
  }
}

/// Throws InputError if it is not.
double above_zero(const RecordedRun& run, const char* name, double otherwise) {
  const double value = attribute(run, name, otherwise);
  if (!(value > 0.0)) {
    throw InputError({run.file, fmt::format("attribute /rig {}", name), fmt::format("is {}", value),
                      "It must be above zero. Correct the rig's description."});
  }
  return value;
}

/// The base rig that a run describes; what it does not state is the paper's. Throws InputError where a rig cannot be so.
RigModel base_model(const RecordedRun& run) {
  RigModel model;
  Hose& hose = model.hose;
  hose.length_m = above_zero(run, "hose_length_m", hose.length_m);
  hose.bore_mm = above_zero(run, "hose_bore_mm", hose.bore_mm);
  hose.density_kg_m3 = above_zero(run, "fluid_density_kg_m3", hose.density_kg_m3);
  hose.viscosity_Pa_s = above_zero(run, "fluid_viscosity_Pa_s", hose.viscosity_Pa_s);
  hose.wave_speed_m_s = above_zero(run, "hose_wave_speed_m_s", hose.wave_speed_m_s);
  hose.loss_coefficient = attribute(run, "hose_minor_loss_K", hose.loss_coefficient);
  hose.loss_at_cavity = attribute(run, "hose_loss_at_cavity", hose.loss_at_cavity);
  hose.creep_fraction = attribute(run, "hose_creep_fraction", hose.creep_fraction);
  hose.creep_time_s = above_zero(run, "hose_creep_time_s", hose.creep_time_s);
  model.drive_lag_s = attribute(run, "drive_lag_s", model.drive_lag_s);
  model.catheter.resonance_Hz = above_zero(run, "catheter_f0_Hz", model.catheter.resonance_Hz);
  model.catheter.damping = above_zero(run, "catheter_zeta", model.catheter.damping);
  if (!(hose.loss_at_cavity >= 0.0 && hose.loss_at_cavity <= 1.0)) {
    throw InputError({run.file, "attribute /rig hose_loss_at_cavity",
                      fmt::format("is {}, and a part of a loss is between 0 and 1", hose.loss_at_cavity),
                      "1: all of it is at the cavity. Correct the rig's description."});
  }
  constexpr double longest_lag_s = 1.0;
  if (!(model.drive_lag_s >= 0.0 && model.drive_lag_s <= longest_lag_s)) {
    throw InputError(
        {run.file, "attribute /rig drive_lag_s", fmt::format("is {}", model.drive_lag_s),
         "A piston follows its steps some milliseconds later: 0.004, say. Correct the rig's description."});
  }
  return model;
}

MotionLimits limits_of(const RecordedRun& run) {
  MotionLimits limits;
  limits.flow_mL_s = attribute(run, "limit_flow_mL_s", limits.flow_mL_s);
  limits.acceleration_mL_s2 = attribute(run, "limit_acceleration_mL_s2", limits.acceleration_mL_s2);
  limits.pressure_kPa = attribute(run, "limit_pressure_kPa", limits.pressure_kPa);
  return limits;
}

}  // namespace

std::string_view name_of(Channel channel) { return channel == Channel::cavity ? "cavity_kPa" : "pump_kPa"; }

Session read_session(const Study& study) {
  if (study.data.runs.empty()) {
    throw InputError({study.file.string(), "data.runs", "names no run files",
                      "List the runs to compare with the rig's model: runs = [\"baseline.run.h5\"]."});
  }
  Session session;
  session.effects = effects_known_to(study);
  std::map<std::string, std::filesystem::path> file_of_run;
  for (const std::filesystem::path& file : study.data.runs) {
    RecordedRun run = runfile::read_run(file);
    if (const auto [other, is_new] = file_of_run.try_emplace(run.run_id, file); !is_new) {
      throw InputError({study.file.string(), "data.runs",
                        fmt::format("{} and {} are one recording (run {})", other->second.string(),
                                    file.string(), run.run_id),
                        "Data that count twice make intervals too narrow: name it once."});
    }
    if (run.pump.time_s.size() < 2 || run.pressure.time_s.size() < 2) {
      throw InputError({file.string(), "dataset /pump/commanded_mL",
                        "the run holds no motion or no pressures", "Take the run off the study's list."});
    }
    if (session.runs.empty()) {
      session.base = base_model(run);
      session.limits = limits_of(run);
      constexpr std::string_view of_tolerance = "tolerance_";
      for (const auto& [name, value] : run.rig)
        if (name.starts_with(of_tolerance))
          session.tolerance_sd[name.substr(of_tolerance.size())] = attribute(run, name, 0.0);
    }
    session.runs.push_back(session_run(std::move(run), short_name(file)));
  }
  double first_s = std::numeric_limits<double>::infinity();
  for (const SessionRun& run : session.runs)
    first_s = std::min(first_s, run.drive.place.started_s);
  for (SessionRun& run : session.runs) {
    const double since = run.drive.place.started_s - first_s;
    run.drive.place.started_s = since >= 0.0 ? since : 0.0;  // NaN too
  }
  set_history(session);
  return session;
}

std::vector<StatedEffect> stated_effects(const Study& study, const Session& session) {
  std::vector<StatedEffect> list;
  for (const std::string& id : study.effects) {
    StatedEffect& stated = list.emplace_back();
    stated.effect = &effect_named(session.effects, study, id);
    const auto given = std::ranges::find(study.effect_values, id, &StudyEffect::id);
    for (const EffectParameter& parameter : stated.effect->parameters()) {
      double value = parameter.typical;
      if (given != study.effect_values.end())
        if (const auto start = given->starts.find(std::string(parameter.name)); start != given->starts.end())
          value = std::clamp(start->second, parameter.lower, parameter.upper);
      stated.values.push_back(value);
    }
    if (given == study.effect_values.end()) continue;
    for (const StudyMoment& moment : given->moments) {
      const auto in = std::ranges::find(session.runs, moment.run,
                                        [](const SessionRun& run) { return run.drive.place.name; });
      if (in == session.runs.end())
        throw InputError({study.file.string(), "model.moments." + id,
                          fmt::format("the study has no run \"{}\"", moment.run),
                          "Name one of data.runs, without .run.h5."});
      stated.change_points.push_back({moment.run, moment.time_s, in->drive.place.started_s + moment.time_s});
    }
  }
  return list;
}

}  // namespace diastole::rig
