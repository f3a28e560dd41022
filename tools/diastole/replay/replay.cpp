#include "tools/diastole/commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>

#include "host/cli/session_view.hpp"
#include "host/config/rig_config.hpp"
#include "host/journal/journal.hpp"
#include "host/journal/part_file.hpp"
#include "host/rpc/run_session.hpp"
#include "host/runfile/assemble.hpp"
#include "host/runfile/output_guard.hpp"
#include "host/runfile/writer.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/runfile/reader.hpp"
#include "tools/diastole/replay/operator.hpp"
#include "tools/diastole/replay/replay_report.hpp"
#include "tools/diastole/simulate/simulated_rig.hpp"
#include "tools/diastole/simulate/stop_signals.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using runfile::RunFile;

constexpr double quiet_s = 2;     ///< of wall time, before progress is shown
constexpr int most_attempts = 3;  ///< at what began unseen
constexpr double jog_rate_mL_s = 5;
constexpr const char* replayed_file = "replayed.run.h5";
constexpr const char* closest_file = "closest.run.h5";

struct ReplayOptions {
  std::string run;
  std::string output;
  std::string image;
  std::string config;
  bool real_time = false;
  bool force = false;
};

/// The recording; a journal is assembled first, and brought to a file in `directory` that the instrument can play.
struct Recording {
  RunFile run;
  fs::path file;
};

Recording read_recording(const ReplayOptions& options, const PrivateDirectory& directory) {
  if (!options.run.ends_with(".journal")) return {runfile::open_run(options.run), options.run};
  const fs::path file = directory / "recovered.run.h5";
  write_run(file, stream_run(JournalRecords(options.run)));
  Recording recording{runfile::open_run(file), file};
  recording.run.run.file = options.run;
  return recording;
}

std::string write_experiment(const replay::ReplayPlan& plan, const PrivateDirectory& directory) {
  for (const auto& [name, text] : plan.points)
    std::ofstream(directory.path() / name) << text;
  const fs::path file = directory / "replay.experiment.toml";
  std::ofstream(file) << plan.experiment_toml;
  return file;
}

SimulatedRigOptions rig_options(const ReplayOptions& options, const replay::ReplayPlan& plan,
                                const Recording& recording, const PrivateDirectory& directory) {
  SimulatedRigOptions rig;
  rig.config = directory / "replay.rig.toml";
  std::ofstream(rig.config) << plan.rig_toml;
  rig.image = options.image;
  rig.real_time = options.real_time;
  rig.more = {"--play",           fs::absolute(recording.file),
              "--control",        directory / "control",
              "--host-drift-ppm", fmt::format("{:.6f}", options.real_time ? 0 : plan.host_drift_ppm)};
  for (const std::string& fault : plan.faults)
    rig.more.insert(rig.more.end(), {"--fault", fault});
  return rig;
}

/// Brings the pump to where it stood before the recorded run; returns the firmware's version.
std::string prepare(DaemonClient& daemon, const replay::ReplayPlan& plan) {
  if (!plan.settings.empty()) daemon.call("rig.write_settings", {{"set", plan.settings}});
  daemon.call("rig.home");
  if (plan.start_mL != 0) daemon.call("rig.jog", {{"mL", plan.start_mL}, {"rate_mL_s", jog_rate_mL_s}});
  return daemon.call("rig.status").at("firmware");
}

/// The replay as it was recorded in its turn; none when the user has broken it off.
std::optional<RunFile> replay_once(const ReplayOptions& options, const replay::ReplayPlan& plan,
                                   const Recording& recording, const PrivateDirectory& directory,
                                   std::string& firmware) {
  const StopSignals signals;
  SimulatedRig rig(directory, rig_options(options, plan, recording, directory));
  DaemonClient daemon(rig.socket());
  firmware = prepare(daemon, plan);
  replay::Operator rig_operator(directory / "control", rig.socket(), plan.orders);

  SessionView view(isatty(STDERR_FILENO) != 0);
  const auto started = std::chrono::steady_clock::now();
  SessionOptions session;
  session.experiment = write_experiment(plan, directory);
  session.output = directory / replayed_file;
  session.force = true;  // of a first attempt
  session.poll_ms = 5;
  session.stops_asked = [&] {
    rig_operator.attend();
    return signals.asked() > 0 ? 2 : 0;  // whoever breaks a replay off does not wait for a cycle's end
  };
  session.progress = [&](SessionProgress progress) {
    progress.new_remarks.clear();  // those of the recording, once more
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count() > quiet_s)
      view.show(progress);
  };
  run_session(daemon, session);
  view.finish();
  if (signals.asked() > 0) return std::nullopt;
  return runfile::open_run(session.output);
}

std::optional<MotionLimits> limits_in(const std::string& config) {
  if (config.empty()) return std::nullopt;
  return read_rig(config).controller.limits;
}

/// By how much the sign of something that began unseen came too late; 0 if neither run has one, none if the sign of one
/// is missing in the other.
std::optional<double> lateness_s(const RunFile& recorded, const RunFile& replayed) {
  const auto sign = replay::late_sign(recorded.run), now = replay::late_sign(replayed.run);
  if (!sign && !now) return 0;
  if (!sign || !now || sign->code != now->code) return std::nullopt;
  return now->time_s - sign->time_s;
}

/// Replays, as often as shifting what began unseen brings its sign closer; keeps the closest. None when the user has
/// broken it off.
std::optional<RunFile> replay_closest(const ReplayOptions& options, const Recording& recording,
                                      const PrivateDirectory& directory, replay::ReplayReport& report) {
  replay::PlanOptions plan_options{.limits = limits_in(options.config)};
  std::optional<RunFile> closest;
  double least_late_s = HUGE_VAL;
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    replay::ReplayPlan plan = replay::plan_replay(recording.run, plan_options);
    std::optional<RunFile> replayed = replay_once(options, plan, recording, directory, report.firmware);
    if (!replayed) return std::nullopt;
    const std::optional<double> late_s = lateness_s(recording.run, *replayed);
    const double off_s = late_s ? std::abs(*late_s) : HUGE_VAL;
    if (!closest || off_s < least_late_s) {
      least_late_s = off_s;
      report.comparison = replay::compare(recording.run, *replayed);
      report.plan = std::move(plan);
      closest = std::move(replayed);
      fs::rename(directory / replayed_file, directory / closest_file);
    }
    // What did not recur shows no better moment.
    if (!late_s || *late_s == 0 || report.comparison.equal()) break;
    plan_options.onset_shift_s -= *late_s;
  }
  return closest;
}

void keep_closest(const PrivateDirectory& directory, const std::string& output) try {
  copy_durably(directory / closest_file, output);
} catch (const fs::filesystem_error& error) {
  throw HardwareError(output, error.what(), "Check that you may write there.");
}

/// None when the user has broken it off.
std::optional<replay::ReplayReport> replay_run(const ReplayOptions& options) {
  const auto started = std::chrono::steady_clock::now();
  if (!options.output.empty()) check_output(options.output, options.force, {options.run});
  const PrivateDirectory directory;
  const Recording recording = read_recording(options, directory);
  replay::ReplayReport report;
  report.recorded = options.run;
  report.replayed = options.output;
  const std::optional<RunFile> replayed = replay_closest(options, recording, directory, report);
  if (!replayed) return std::nullopt;
  report.firmware = fmt::format("{} {}", options.image.empty() ? "the firmware's host build" : options.image,
                                report.firmware);
  if (!options.output.empty()) keep_closest(directory, options.output);
  const runfile::Series& time_s = replayed->rows.pressure.time_s;
  if (time_s.size() > 0) report.simulated_s = time_s.back();
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return report;
}

}  // namespace

void add_replay(CommandLine& line) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = line.add(
      "replay", "play a recorded run through simulated instrument, real firmware and real daemon; compare",
      "  diastole replay gel.run.h5\n"
      "      its experiment, with its pressure at the instrument and its faults at their time\n"
      "  diastole replay gel.run.h5 --image build/firmware/bin/diastole-stm32f405.elf\n"
      "      the image that is flashed, in the emulator, instead of the firmware built for this machine\n"
      "  diastole replay journals/5e0c....journal -o again.run.h5\n"
      "      a run that broke off; keep what the replay recorded\n"
      "Recorded gaps, stops, emergency stops, limit switches and losses of the line happen again at their\n"
      "time. Exit code 0: the replay is the recording; 1: it differs, and the first difference is printed "
      "with\n"
      "time and cycle, or it was broken off; 2: the file lacks what a replay needs; 3: a program or link "
      "failed.");
  command->add_option("RUN", options->run, "run file, or a journal of the daemon")->required();
  command->add_option("-o,--output", options->output, "keep the replay's own run file");
  command
      ->add_option("--image", options->image,
                   "run this image of the firmware (.elf or .bin) on the emulated board")
      ->check(CLI::ExistingFile);
  command->add_option("--config", options->config,
                      "rig file whose [controller.limits] hold for an older run");
  command->add_flag("--real-time", options->real_time, "as slow as the real thing");
  command->add_flag("--force", options->force, "replace the output if it exists");
  line.on_run(command, [options](const CommandOutput& out) {
    const std::optional<replay::ReplayReport> report = replay_run(*options);
    if (!report) {
      std::cerr << options->run << ": the replay was broken off; nothing was compared\n";
      if (out.json) std::cout << json_text(json{{"broken_off", true}}, 2) << '\n';
      return ExitCode::negative;
    }
    if (out.json) {
      std::cout << json_text(replay::as_json(*report), 2) << '\n';
    } else {
      fmt::print("{}", replay::as_table(*report));
    }
    return report->comparison.equal() ? ExitCode::done : ExitCode::negative;
  });
}

}  // namespace diastole
