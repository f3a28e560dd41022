#include "tools/diastole/commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/cli/session_facts.hpp"
#include "host/cli/session_series.hpp"
#include "host/cli/session_view.hpp"
#include "host/config/experiment.hpp"
#include "host/journal/part_file.hpp"
#include "host/rpc/run_session.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"
#include "tools/diastole/simulate/gated_volume.hpp"
#include "tools/diastole/simulate/simulated_rig.hpp"
#include "tools/diastole/simulate/stop_signals.hpp"
#include "tools/sim_rig/hidden_effects.hpp"
#include "tools/sim_rig/hidden_file.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

struct SimulateOptions {
  SessionOptions session;
  SimulatedRigOptions rig;
  uint64_t rig_seed = 0;
  std::vector<std::string> faults;
  std::vector<std::string> hidden;
  std::optional<uint64_t> hide_seed;
  std::string sealed;
  std::optional<double> gated_sd_mL;
};

struct SimulatedSession {
  SessionResult result;
  double simulated_s = 0;
  double wall_s = 0;
};

void require_writable_folder(const fs::path& file, const char* option) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (fs::is_directory(file)) {
    throw InputError({file.string(), "", "is a directory", fmt::format("Name a file for {}.", option)});
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    throw InputError({folder.string(), "", "is no directory in which you may write",
                      fmt::format("Make it (mkdir), or choose another place for {}.", option)});
  }
}

/// Before a session of perhaps an hour: both outputs can be written, are two files, and are not what is read.
void check_outputs(const SimulateOptions& options) {
  const fs::path run = options.session.output, pins = options.rig.pins;
  require_writable_folder(run, "-o");
  if (!options.sealed.empty()) {
    require_writable_folder(options.sealed, "--sealed");
    if (options.hidden.empty()) {
      throw InputError(
          {"", "option --sealed", "nothing is hidden", "Say what to hide: --hide ID, none, outside or any."});
    }
  }
  for (const fs::path& output : {run, pins}) {
    for (const fs::path input : {options.session.experiment, options.rig.config, options.rig.image}) {
      std::error_code missing;
      if (!output.empty() && !input.empty() && fs::equivalent(input, output, missing)) {
        throw InputError({output.string(), "", "is read by this command and cannot be its output too",
                          "Give the output another name."});
      }
    }
  }
  if (pins.empty()) return;
  require_writable_folder(pins, "--pins");
  if (fs::weakly_canonical(fs::absolute(run)) == fs::weakly_canonical(fs::absolute(pins))) {
    throw InputError({pins.string(), "", "is named for both the run file and the pin trace",
                      "Give -o and --pins two names."});
  }
}

/// The pin trace appears under its own name only when it is complete.
class PendingFile {
 public:
  PendingFile(std::string name, bool force) : name_(std::move(name)) {
    if (!name_.empty() && fs::exists(name_) && !force) {
      throw InputError({name_, "", "exists already", "Choose another name, or --force to replace it."});
    }
  }
  ~PendingFile() {
    std::error_code ignored;
    if (!name_.empty()) fs::remove(path(), ignored);
  }
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  [[nodiscard]] std::string path() const { return name_.empty() ? "" : part_file_of(name_).string(); }
  void complete() const {
    if (!name_.empty()) fs::rename(path(), name_);
  }

 private:
  std::string name_;
};

/// Runs a session; when no run file can be delivered the journal stays in `directory`.
SessionResult run_in(PrivateDirectory& directory, DaemonClient& daemon, const SessionOptions& options) {
  try {
    return run_session(daemon, options);
  } catch (const HardwareError&) {
    if (fs::exists(directory / "journals") && !fs::is_empty(directory / "journals")) {
      directory.keep();
      fmt::print(stderr, "What was recorded stays in {}\n", directory.path().string());
    }
    throw;
  }
}

/// What the rig's program is started with.
SimulatedRigOptions rig_options(const SimulateOptions& options, const fs::path& volume) {
  SimulatedRigOptions rig = options.rig;
  const auto add = [&rig](std::initializer_list<std::string> words) {
    rig.more.insert(rig.more.end(), words.begin(), words.end());
  };
  add({"--rig-seed", fmt::to_string(options.rig_seed)});
  for (const std::string& fault : options.faults)
    add({"--fault", fault});
  for (const std::string& id : options.hidden)
    add({"--hide", sim_rig::is_effect_file(id) ? fs::absolute(id).string() : id});
  if (options.hide_seed) add({"--hide-seed", fmt::to_string(*options.hide_seed)});
  if (!options.sealed.empty()) add({"--sealed", options.sealed});
  if (options.gated_sd_mL) add({"--volume", volume.string()});
  return rig;
}

/// The rig, homed, for one session or several.
class Simulation {
 public:
  explicit Simulation(SimulateOptions options)
      : options_(std::move(options)),
        view_(isatty(STDERR_FILENO) != 0),
        rig_(directory_, rig_options(options_, directory_ / "volume.csv")),
        daemon_(rig_.socket()) {
    options_.session.stops_asked = [this] { return signals_.asked(); };
    options_.session.prompts_answered = true;  // nobody is waited for in a simulation
    options_.session.progress = [this](const SessionProgress& progress) { view_.show(progress); };
    daemon_.call("rig.home");
  }

  SessionResult acquire(const std::string& experiment, const std::string& run) {
    options_.session.experiment = experiment;
    options_.session.output = run;
    SessionResult result = run_in(directory_, daemon_, options_.session);
    view_.finish();
    if (options_.gated_sd_mL) {
      const std::string remark = store_gated_volume(run, directory_ / "volume.csv", triggers_,
                                                    {*options_.gated_sd_mL, options_.rig.seed});
      if (!remark.empty()) fmt::print(stderr, "{}: {}\n", run, remark);
    }
    triggers_ += static_cast<size_t>(result.triggers);
    return result;
  }
  void stop() { rig_.stop(); }

 private:
  SimulateOptions options_;
  const StopSignals signals_;
  SessionView view_;
  PrivateDirectory directory_;
  SimulatedRig rig_;
  DaemonClient daemon_;
  size_t triggers_ = 0;  ///< of the sessions so far
};

SimulatedSession simulate(SimulateOptions options) {
  const auto started = std::chrono::steady_clock::now();
  const Experiment experiment = read_experiment(options.session.experiment);
  check_outputs(options);
  const PendingFile pins(options.rig.pins, options.session.force);
  options.rig.pins = pins.path();
  Simulation simulation(options);
  SimulatedSession session{simulation.acquire(options.session.experiment, options.session.output), 0, 0};
  simulation.stop();
  pins.complete();
  session.simulated_s = static_cast<double>(session.result.expected) / experiment.sample_rate_Hz;
  session.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return session;
}

ExitCode report(const SimulatedSession& session, bool json) {
  const SessionResult& result = session.result;
  if (!json) {
    const ExitCode code = report_session(result, false);
    fmt::print("{:.1f} s simulated in {:.2f} s\n", session.simulated_s, session.wall_s);
    return code;
  }
  const nlohmann::json document{DIASTOLE_NAMED(result, run, end, cycles, triggers, samples, gaps, expected),
                                {"simulated_seconds", session.simulated_s},
                                {"wall_seconds", session.wall_s}};
  std::cout << json_text(document, 2) << '\n';
  return exit_code_of(result);
}

/// One rig for all sessions, as a laboratory has.
ExitCode simulate_series(const SimulateOptions& options, SessionSeries& series, const CommandOutput& out) {
  check_outputs(options);
  if (!options.rig.pins.empty()) {
    throw InputError({"", "option --pins", "is for one session", "Leave it out beside --shape."});
  }
  std::optional<Simulation> simulation;
  const SessionSeries::Acquire acquire = [&](const std::string& experiment, const std::string& run) {
    return simulation->acquire(experiment, run);
  };
  const ExitCode code = series.carry_out(
      options.session.output, options.session.force,
      [&] {
        simulation.emplace(options);
        return acquire;
      },
      out);
  if (simulation) simulation->stop();
  return code;
}

ExitCode simulate_as_asked(const SimulateOptions& options, SessionSeries& series, const CommandOutput& out) {
  sim_rig::PlantConfig unused;
  sim_rig::hide(options.hidden, 0, unused);  // refuses unknown ids
  if (series.asked() != options.session.experiment.empty()) {
    throw InputError({"", "EXPERIMENT", series.asked() ? "is not asked for beside --shape" : "is missing",
                      "Give an experiment file, or --shape TARGET.csv --study STUDY."});
  }
  if (series.asked()) return simulate_series(options, series, out);
  return report(simulate(options), out.json);
}

}  // namespace

void add_simulate(CommandLine& line, std::shared_ptr<SessionSeries> series) {
  auto options = std::make_shared<SimulateOptions>();
  options->session.poll_ms = 20;
  CLI::App* command = line.add(
      "simulate", "a whole session without hardware: simulated rig, real daemon, as fast as it goes",
      "  diastole simulate examples/gel.experiment.toml -o gel.run.h5\n"
      "      the paper's gel phantom in the built-in rig\n"
      "  diastole simulate gel.experiment.toml -o gel.run.h5 --pins gel.pins.csv --seed 7\n"
      "      also every edge of the controller's pins; other sensor noise\n"
      "  diastole simulate gel.experiment.toml -o soft.run.h5 --config soft.rig.toml\n"
      "      another rig; its table [simulation] holds the gel's stiffness C1_kPa, noise and more\n"
      "  diastole simulate gel.experiment.toml -o stopped.run.h5 --fault estop@run+3.2 --fault leak@run+1\n"
      "      with faults of the rig, by name; `sim_rig faults` lists them\n"
      "  diastole simulate gel.experiment.toml -o mine.run.h5 --hide any --hide-seed 7 --sealed "
      "mine.sealed.json\n"
      "      a rig in which something is hidden (sim_rig hidden), for diastole explain to find\n"
      "  diastole simulate --shape examples/shape/ventricle.csv --study gel.study.toml -o followed.run.h5 "
      "--hide "
      "backlash --gated-volume 0.1\n"
      "      sessions in which the pump learns the drive for a curve (diastole shape), with gated volumes\n"
      "The same seed gives the same run. Ctrl-C once stops at the end of the cycle, twice at once; what\n"
      "was recorded is kept. Exit code 1: samples are missing; 3: a fault ended the run.");
  command->add_option("EXPERIMENT", options->session.experiment, "experiment file (.toml)");
  command->add_option("-o,--output", options->session.output, "run file to write")->required();
  command
      ->add_option("--image", options->rig.image,
                   "run this image of the firmware (.elf or .bin) on the emulated board")
      ->check(CLI::ExistingFile);
  command->add_option("--pins", options->rig.pins, "pin trace to write: time_ns,signal,value");
  command->add_option("--seed", options->rig.seed, "of the sensors' noise")->capture_default_str();
  command
      ->add_option("--rig-seed", options->rig_seed,
                   "of the rig's own imperfections, the same for all sessions of one rig; 0: none")
      ->capture_default_str();
  command->add_option("--config", options->rig.config, "rig file, instead of the built-in one");
  command->add_option("--fault", options->faults,
                      "make something go wrong, NAME@run+SECONDS (sim_rig faults, sim_rig --help)");
  command->add_option("--hide", options->hidden,
                      "hide an effect (sim_rig hidden), one of a file NAME.effect.toml, none, outside or "
                      "any; may be repeated");
  command->add_option(
      "--hide-seed", options->hide_seed,
      "of the hidden effects' sizes, the same for all runs of a session; if not given, that of the noise");
  command->add_option("--sealed", options->sealed, "file for what is hidden; the run file does not tell");
  command
      ->add_option("--gated-volume", options->gated_sd_mL,
                   "also measure the cavity's volume as gated imaging does (/mr/flow), with this sd in mL")
      ->check(number_between(1e-3, 100.0));
  add_facts_to(*command, options->session.facts);
  command->add_flag("--real-time", options->rig.real_time, "as slow as the real thing");
  command->add_flag("--force", options->session.force, "replace files that exist");
  series->add_options(*command);
  line.on_run(command, [options, series](const CommandOutput& out) {
    return simulate_as_asked(*options, *series, out);
  });
}

}  // namespace diastole
