// A run: loading, recording, and making its file (rig_service.hpp).

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/uuid/random_generator.hpp>
#include <boost/uuid/uuid_io.hpp>
#include <chrono>

#include "host/acquisition/disk_space.hpp"
#include "host/config/experiment.hpp"
#include "host/controller/settings_values.hpp"
#include "host/journal/journal_store.hpp"
#include "host/journal/part_file.hpp"
#include "host/rig/rig_service.hpp"
#include "host/runfile/assemble.hpp"
#include "host/runfile/writer.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole {
namespace {

/// For as long as it lives, the supervisor waits for work that does not sleep.
class LongWork {
 public:
  explicit LongWork(ServiceManager* manager) : manager_(manager) {
    if (manager_ != nullptr) manager_->allow(long_work_timeout);
  }
  ~LongWork() {
    if (manager_ != nullptr) manager_->allow_no_more();
  }
  LongWork(const LongWork&) = delete;
  LongWork& operator=(const LongWork&) = delete;

 private:
  static constexpr std::chrono::minutes long_work_timeout{10};
  ServiceManager* manager_;
};

std::vector<runfile::Segment> planned_segments(const Experiment& experiment, const ProgramPlan& plan) {
  std::vector<runfile::Segment> segments;
  double start_s = experiment.rest_s;
  for (size_t i = 0; i < experiment.segments.size(); ++i) {
    const ExperimentSegment& segment = experiment.segments[i];
    if (i < plan.size()) start_s = 1e-6 * static_cast<double>(plan[i].start_us);
    segments.push_back({start_s, segment.waveform_name, segment.stroke_mL, segment.period_s,
                        segment.offset_mL, segment.cycles});
    start_s = segments.back().end_s();
  }
  return segments;
}

/// What uploaded segments follow, by segment.
std::vector<PlayedSegment> played_waveforms(const Experiment& experiment) {
  std::vector<PlayedSegment> waveforms;
  for (size_t i = 0; i < experiment.segments.size(); ++i) {
    if (!experiment.segments[i].upload) continue;
    const ExperimentWaveform& waveform = experiment.waveforms[*experiment.segments[i].upload];
    waveforms.push_back({i, waveform.points.text, waveform.even.fractions()});
  }
  return waveforms;
}

double duration_s(const Experiment& experiment, const ProgramPlan& plan) {
  if (plan.empty()) return experiment.least_duration_s();
  return 1e-6 * static_cast<double>(plan.back().start_us + plan.back().duration_us);
}

/// What the controller's own settings say of the rig; the volume of a step is the calibrated one.
void add_settings(Attributes& rig, const ControllerClient& controller) {
  const wire::SettingsReport& report = controller.settings();
  const Attributes own = settings_values(report.settings);
  for (const char* name : {"calibration_ppm", "backlash_um", "travel_mm", "full_step_rate_Hz", "board_name"})
    rig[name] = own.at(name);
  rig["settings_record"] = int64_t{report.records_written};
  rig["volume_per_step_mL"] = 1e-9 * controller.microstep_pL();
}

/// What the controller was held to.
void add_limits(Attributes& rig, const ControllerConfig& controller) {
  const MotionLimits& limits = controller.limits;
  rig["limit_travel_mL"] = limits.travel_mL;
  rig["limit_flow_mL_s"] = limits.flow_mL_s;
  rig["limit_acceleration_mL_s2"] = limits.acceleration_mL_s2;
  rig["limit_step_rate_Hz"] = limits.step_rate_Hz;
  rig["limit_pressure_kPa"] = limits.pressure_kPa;
  rig["limit_cavity_kPa"] = limits.cavity_kPa;
  rig["lease_ms"] = controller.lease_ms;
}

/// Takes a program that will not be started out of the controller: it would wait armed.
void disarm(ControllerClient& controller) {
  if (!controller.connected() || controller.last_known().state == wire::State::faulted) return;
  try {
    controller.unload();
  } catch (const std::exception& error) {
    spdlog::warn("the program that is not run stays loaded: {}", error.what());
  }
}

/// What is prepared for a run: a program in the controller, a journal. Undone unless the run begins.
class Preparation {
 public:
  Preparation(ControllerClient& controller, std::filesystem::path journal)
      : controller_(controller), journal_(std::move(journal)) {}
  ~Preparation() {
    if (begun_) return;
    std::error_code ignored;
    std::filesystem::remove(journal_, ignored);
    disarm(controller_);
  }
  Preparation(const Preparation&) = delete;
  Preparation& operator=(const Preparation&) = delete;
  void begun() { begun_ = true; }

 private:
  ControllerClient& controller_;
  std::filesystem::path journal_;
  bool begun_ = false;
};

}  // namespace

SessionSoFar RigService::resume(Experiment& study) {
  if (!study.schedule) {
    throw InputError({study.file, "schedule", "is missing: nothing says where this experiment could go on",
                      "Run it from its beginning, without --resume."});
  }
  std::optional<SessionSoFar> session;
  const LongWork reading(options_.manager);
  beside_the_line([&] { session = last_session(rig_.daemon.journal_dir, study.text, *study.schedule); });
  if (!session) {
    throw InputError(
        {study.file, "",
         fmt::format("has no session to resume: no journal in {} is of it", rig_.daemon.journal_dir.string()),
         "The file must be as it was run, to the letter; without --resume a session begins."});
  }
  if (std::ssize(session->done) == study.schedule->slices()) {
    throw InputError({study.file, "",
                      fmt::format("has nothing left to do: all {} slices of the session of {} are imaged",
                                  session->done.size(), session->started_utc),
                      "Without --resume a new session begins."});
  }
  leave_out(study, session->done);
  return *session;
}

void RigService::do_run(RunOrder order, const Done& done) {
  Experiment& experiment = order.experiment;
  std::optional<SessionSoFar> before;
  if (order.resume) before = resume(experiment);
  (void)do_status();
  const daq::RatePlan rate = instrument_->plan_rate(experiment.sample_rate_Hz);
  RunPlan run{.run_id = boost::uuids::to_string(boost::uuids::random_generator()())};
  const std::filesystem::path path =
      std::filesystem::absolute(rig_.daemon.journal_dir) / (run.run_id + ".journal");
  Preparation preparation(*controller_, path);
  const ProgramPlan plan = controller_->load(experiment);
  run.planned_s = duration_s(experiment, plan);
  run.estimate_s = experiment.schedule ? experiment.estimate_s() : run.planned_s;
  run.planned_cycles = experiment.planned_cycles();
  check_disk(run, rate, experiment.cycles());
  JournalWriter journal(path);
  write_beginning(journal, run, order, plan, rate.rate_Hz, before);
  live_.begin(run.run_id, rate.rate_Hz, controller_->hello().tick_rate_Hz);
  if (!queue_.begin("running", [&] { run_.begin(run); })) refuse_to_start();
  preparation.begun();
  for (const std::string& doubt : doubts_about(experiment))
    note({"warning", "experiment", doubt});
  if (before) {
    note({"info", "resumed",
          fmt::format("the session of run {} ({}) goes on: {} of its {} slices are imaged", before->run_id,
                      before->started_utc, before->done.size(), experiment.schedule->slices())});
  }
  spdlog::info("run {} begins: {} cycles, {:.1f} s", run.run_id, run.planned_cycles, run.planned_s);
  done(nullptr, RunBegun{run.run_id, path.string(), run_file_beside(path).string()});
  RunResult result;
  RunOutcome outcome;
  try {
    outcome = acquire(journal, order, rate, run.planned_s);
    result = finish(path, outcome);
  } catch (const std::exception& error) {
    if (controller_->connected()) controller_->stop_now();  // nothing moves unrecorded
    result = {.end = "failed", .journal = path.string(), .problem = error.what()};
    if (!outcome.first_error.empty())
      result.problem += fmt::format(" (the run's first error: {})", outcome.first_error);
  }
  if (controller_->last_known().state == wire::State::armed) disarm(*controller_);
  spdlog::info("run {} ended: {}, {}", run.run_id, result.end,
               result.run_file.empty() ? result.problem : result.run_file);
  tidy_journals();
  queue_.leave([&] { run_.end(result); });
}

void RigService::check_disk(const RunPlan& plan, const daq::RatePlan& rate, int64_t most_cycles) {
  RunSize size{plan.planned_s, rate.rate_Hz, controller_->position_rate_Hz(), rig_.daq.channels.size(),
               static_cast<uint64_t>(most_cycles)};
  if (!rate.warning.empty()) size.gaps_Hz = rate.rate_Hz / 2;
  check_disk_space(rig_.daemon.journal_dir, size);
}

void RigService::tidy_journals() {
  const auto& [directory, keep_days] = std::pair(rig_.daemon.journal_dir, rig_.daemon.keep_days);
  if (keep_days > 0) {
    const auto before = std::filesystem::file_time_type::clock::now() - std::chrono::hours(24 * keep_days);
    for (const auto& removed : prune_journals(directory, before)) {
      spdlog::info("{} was removed: its run file is older than {} days", removed.string(), keep_days);
    }
  }
  remove_leftovers(directory);
  uint64_t bytes = 0;
  int64_t without_run_file = 0;
  const auto journals = stored_journals(directory);
  for (const StoredJournal& journal : journals) {
    bytes += journal.bytes;
    without_run_file += journal.has_run_file ? 0 : 1;
  }
  const std::lock_guard lock(mutex_);
  journals_ = {std::filesystem::absolute(directory).string(), journals.size(), bytes, without_run_file,
               keep_days};
}

void RigService::write_beginning(JournalWriter& journal, const RunPlan& run, const RunOrder& order,
                                 const ProgramPlan& plan, double sample_rate_Hz,
                                 const std::optional<SessionSoFar>& before) {
  const Experiment& experiment = order.experiment;
  const TimerFacts timer = make_source(*clock_, *instrument_)->timer(sample_rate_Hz);
  BeginRecord begin{.run_id = run.run_id,
                    .started_utc = utc_now(),
                    .producer = options_.producer,
                    .experiment = experiment.text,
                    .experiment_file = experiment.file,
                    .sample_rate_Hz = sample_rate_Hz,
                    .channels = {},
                    .rig = rig_.attributes,
                    .instrument = instrument_->describe(),
                    .tick_rate_Hz = static_cast<double>(controller_->hello().tick_rate_Hz),
                    .microstep_pL = static_cast<double>(controller_->microstep_pL()),
                    .daq_timer_rate_Hz = std::max(1.0, timer.rate_Hz),
                    .daq_timer_counts_samples = timer.counts_samples,
                    .segments = planned_segments(experiment, plan),
                    .trigger_delay_s = 1e-3 * experiment.trigger_delay_ms,
                    .waveforms = played_waveforms(experiment),
                    .session = order.session,
                    .resumes = before ? before->run_id : "",
                    .slices_done = {}};
  if (before) begin.slices_done.assign(before->done.begin(), before->done.end());
  for (runfile::SessionNote& note : begin.session.notes) {
    if (note.author.empty()) note.author = begin.session.text(runfile::operator_fact);
    if (note.written_utc.empty()) note.written_utc = begin.started_utc;
  }
  for (const ChannelConfig& channel : rig_.daq.channels)
    begin.channels.push_back(channel.name);
  for (const auto& [name, value] : book_.attributes())
    begin.rig[name] = value;
  begin.rig["daq_rate_Hz"] = sample_rate_Hz;
  add_settings(begin.rig, *controller_);
  add_limits(begin.rig, rig_.controller);
  if (!append(journal, begin)) {
    throw HardwareError(journal.path().string(), journal.problem(), "Free some space on that disk.");
  }
}

RunOutcome RigService::acquire(JournalWriter& journal, const RunOrder& order, const daq::RatePlan& rate,
                               double planned_s) {
  std::vector<PlannedSlice> slices;
  if (order.experiment.schedule) slices = planned_slices(*order.experiment.schedule);
  std::vector<std::string> warnings;
  if (!rate.warning.empty()) warnings.push_back(rate.warning);
  const auto samples = make_source(*clock_, *instrument_);
  return diastole::acquire(*clock_, *controller_, *samples, journal,
                           {rate.rate_Hz, rig_.daq.channels, std::move(warnings), gate_.get(), planned_s,
                            std::move(slices), &live_, order.prompts_answered},
                           {
                               .stop = [this] { return queue_.stop_asked(); },
                               .go_on = [this] { return run_.take_go_on(); },
                               .notes = [this] { return run_.take_notes(); },
                               .progress =
                                   [this](const RunProgress& progress) {
                                     if (controller_->connected()) (void)remember(controller_->last_known());
                                     run_.progress(progress);
                                   },
                               .remark =
                                   [this](const RunRemark& remark) {
                                     spdlog::log(
                                         remark.level == "info" ? spdlog::level::info : spdlog::level::warn,
                                         "{}", remark.text);
                                     run_.remark(remark);
                                   },
                           });
}

RunResult RigService::finish(const std::filesystem::path& journal, const RunOutcome& outcome) {
  queue_.change("writing");
  run_.writing();
  const LongWork writing(options_.manager);
  const std::filesystem::path run_file = run_file_beside(journal);
  AssembledRun assembled;
  std::string remark;
  beside_the_line([&] {
    const StreamedRun run = stream_run(JournalRecords(journal));
    remark = write_run(run_file, run);
    assembled = run.assembled;
  });
  if (!remark.empty()) {
    spdlog::warn("{}", remark);
    run_.remark({"warning", "name_unconfirmed", remark});
  }
  const auto& grid = assembled.run.pressure.grid;
  return {.end = outcome.end,
          .journal = journal.string(),
          .run_file = run_file.string(),
          .regular = outcome.regular(),
          .cycles = outcome.cycles,
          .triggers = assembled.run.trigger_s.size(),
          .samples = assembled.samples_received,
          .gaps = assembled.samples_missing,
          .errors = std::ranges::count(assembled.run.events, "error", &runfile::Event::level),
          .expected = grid ? grid->rows() : 0};
}

}  // namespace diastole
